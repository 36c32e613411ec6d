"""Whether this machine can compile extensions for this Python; asked before tools are installed."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
import sysconfig
from pathlib import Path

# What the build asks pip for where it compiles.
TOOLS = ["cython>=3.1,<4", "mypy[mypyc]>=1.18", "setuptools>=68"]
# Where Visual Studio's installer, and so every Visual C++ of it, can be found.
VSWHERE = "Microsoft Visual Studio/Installer/vswhere.exe"


def missing() -> str:
    """What there is not, as a phrase; empty where all is there."""
    if sys.implementation.name != "cpython" or sysconfig.get_config_var("Py_GIL_DISABLED"):
        return "this kind of Python is not compiled for"
    if sys.platform == "win32":
        programs = Path(os.environ.get("PROGRAMFILES(X86)", "C:/Program Files (x86)"))
        there = shutil.which("cl") or (programs / VSWHERE).is_file()
        return "" if there else "Visual C++ is not installed"
    compiler = os.environ.get("CC") or str(sysconfig.get_config_var("CC") or "cc")
    if shutil.which(shlex.split(compiler)[0]) is None:
        return f"there is no C compiler ({compiler})"
    headers = {sysconfig.get_path("include"), sysconfig.get_path("platinclude")}
    if not any(Path(path, "Python.h").is_file() for path in headers):
        return "Python's header files are missing (on Debian: python3-dev)"
    return ""
