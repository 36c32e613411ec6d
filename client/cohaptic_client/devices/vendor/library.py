"""Loads a maker's library, or says in one sentence that it is missing."""

from __future__ import annotations

import ctypes
import sys
from typing import Any

from cohaptic.errors import DeviceError


def load(name: str, files: dict[str, str], path: str, where: str) -> ctypes.CDLL:
    """The library of a device.

    Args:
        name: Of the device.
        files: Name of the library's file for each `sys.platform`; "" for all others.
        path: Of the file, where the user told it; empty to let the system look.
        where: The user gets the library, for the error.

    Raises:
        DeviceError: It is missing, or is no library.
    """
    file = path or files.get(sys.platform, files[""])
    try:
        return ctypes.CDLL(file)
    except OSError as error:
        advice = f"install {where}, or tell where it is: {name}:library=FILE"
        raise DeviceError(name, f"its maker's library {file} cannot be loaded", advice) from error


def function(library: ctypes.CDLL, device: str, name: str) -> Any:
    """A function of a library; raises DeviceError when the library is one without it."""
    try:
        return getattr(library, name)
    except AttributeError as error:
        problem = f"its maker's library has no function {name}"
        advice = "install a newer version of it"
        raise DeviceError(device, problem, advice) from error
