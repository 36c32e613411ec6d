"""Whether this machine can compile extensions for this Python; asked before tools are installed."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

# What the build asks pip for where it compiles.
TOOLS = ["cython>=3.1,<4", "mypy[mypyc]>=1.18", "setuptools>=68"]
_PATIENCE = 30.0  # s for a line of C, on a machine that installs meanwhile
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
    headers = {sysconfig.get_path("include"), sysconfig.get_path("platinclude")}
    if not any(Path(path, "Python.h").is_file() for path in headers):
        return "Python's header files are missing (on Debian: python3-dev)"
    compiler = os.environ.get("CC") or str(sysconfig.get_config_var("CC") or "cc")
    command = [*shlex.split(compiler), *(f"-I{path}" for path in sorted(headers))]
    return "" if _works(command) else f"there is no C compiler that works ({compiler})"


def _works(compiler: list[str]) -> bool:
    """Whether a compiler makes an object of C that includes Python's headers.

    Some are there and no more than a hint; others lack the headers of C that Python's include.
    """
    with tempfile.TemporaryDirectory() as folder:
        source, made = Path(folder, "line.c"), Path(folder, "line.o")
        source.write_text("#include <Python.h>\n")
        command = [*compiler, "-c", str(source), "-o", str(made)]
        try:
            subprocess.run(command, capture_output=True, check=False, timeout=_PATIENCE)
        except (OSError, subprocess.TimeoutExpired):
            return False
        return made.is_file()
