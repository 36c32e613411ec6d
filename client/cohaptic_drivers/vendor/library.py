"""Loads a library of a maker, or says in one sentence why that failed."""

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
    """Load the maker's library for a device.

    Args:
        name: Name of the device.
        files: Name of the library's file for each `sys.platform`; the key "" is for all others.
        path: Path of the file that the user typed; empty to let the system search for it.
        where: Description for the error of where the user gets the library.

    Raises:
        DeviceError: The library is missing or cannot be loaded; the error states the reason.
    """
    file = str(at_home(Path(path))) if path else files.get(sys.platform, files[""])
    try:
        return ctypes.CDLL(file)
    except OSError as error:
        # Linux names the file that it does not find: this one, or one that this one needs. It also
        # says that it does not find a file that is there but made for another processor.
        missing = str(error).startswith(f"{file}: cannot open shared object file: No such file")
        words = "" if missing else f" ({error})"
        if missing and os.path.isfile(file):
            missing, words = False, f" (it is not made for this processor, {platform.machine()})"
        install = missing or sys.platform != "linux"
        advice = f"install {where}, or tell" if install else "see to that, or tell"
        problem = f"its maker's library {file} cannot be loaded{words}"
        raise DeviceError(name, problem, f"{advice} where it is: {name}:library=FILE") from error


def function(library: ctypes.CDLL, device: str, name: str) -> Any:
    """Return a function of a library; raise DeviceError if the library does not have it."""
    try:
        return getattr(library, name)
    except AttributeError as error:
        problem = f"its maker's library has no function {name}"
        advice = "install a newer version of it"
        raise DeviceError(device, problem, advice) from error
