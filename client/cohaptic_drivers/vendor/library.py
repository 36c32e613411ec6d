"""Loads a maker's library, or says in one sentence why it cannot."""

from __future__ import annotations

import ctypes
import os
import platform
import sys
from pathlib import Path
from typing import Any

from cohaptic.errors import DeviceError
from cohaptic.written import at_home


def load(name: str, files: dict[str, str], path: str, where: str) -> ctypes.CDLL:
    """The library of a device.

    Args:
        name: Name of the device.
        files: Name of the library's file for each `sys.platform`; "" for all others.
        path: Path of the file, where the user told it; empty to let the system look.
        where: The user gets the library, for the error.

    Raises:
        DeviceError: It is missing, or there and cannot be loaded, in the loader's own words.
    """
    file = str(at_home(Path(path))) if path else files.get(sys.platform, files[""])
    try:
        return ctypes.CDLL(file)
    except OSError as error:
        # Linux names the file that it does not find: this one, or one that this one needs. It does
        # not find one that is there and made for another processor, either.
        missing = str(error).startswith(f"{file}: cannot open shared object file: No such file")
        words = "" if missing else f" ({error})"
        if missing and os.path.isfile(file):
            missing, words = False, f" (it is not made for this processor, {platform.machine()})"
        install = missing or sys.platform != "linux"
        advice = f"install {where}, or tell" if install else "see to that, or tell"
        problem = f"its maker's library {file} cannot be loaded{words}"
        raise DeviceError(name, problem, f"{advice} where it is: {name}:library=FILE") from error


def function(library: ctypes.CDLL, device: str, name: str) -> Any:
    """A function of a library; raises DeviceError when the library is one without it."""
    try:
        return getattr(library, name)
    except AttributeError as error:
        problem = f"its maker's library has no function {name}"
        advice = "install a newer version of it"
        raise DeviceError(device, problem, advice) from error
