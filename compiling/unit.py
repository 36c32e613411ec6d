"""One unit, compiled by itself in the present folder, which holds a copy of the packages.

    python -m compiling.unit FOLDER MODULE... [--library NAME]

Leaves the extensions below FOLDER, named as their modules.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from compiling.sources import KERNEL_LIBRARY, PACKAGES

# Of Cython: the caller of a kernel answers for shapes and indices, so nothing is checked inside.
DIRECTIVES = {
    "language_level": "3",
    "boundscheck": False,
    "wraparound": False,
    "cdivision": True,
    "infer_types": True,
    "initializedcheck": False,
    "binding": False,
    "annotation_typing": False,
}
MSVC = sys.platform == "win32"
# Square roots and comparisons compile to instructions: nothing here reads errno or traps. Rounding
# and order of operations stay Python's; no -ffast-math.
KERNEL_FLAGS = ["/O2"] if MSVC else ["-O3", "-g0", "-fno-math-errno", "-fno-trapping-math", "-w"]
LIBRARY_FLAGS = ["/O1"] if MSVC else ["-O1", "-g0", "-w"]  # no loop over arrays in it
# mypyc adds -Werror, which is for its authors; a compiler it does not know may warn.
QUIET = [] if MSVC else ["-w"]
# -O2 and -O3 take half as long again to compile, for no gain that can be measured in a period.
LOOP_LEVEL = "1"
MYPY_CONFIG = """
[mypy]
ignore_missing_imports = True
follow_imports = silent
"""


def kernel(name: str) -> Any:
    """Extension of a module with a `.pxd`, translated to C; or of what the kernels share."""
    source, target = name.replace(".", "/") + ".py", f"{name}.c"
    shared = ["--shared", KERNEL_LIBRARY]
    made = (
        ["--generate-shared", target] if name == KERNEL_LIBRARY else [*shared, "-o", target, source]
    )
    directives = [word for key, value in DIRECTIVES.items() for word in ("-X", f"{key}={value}")]
    subprocess.run([sys.executable, "-m", "cython", "-I", ".", *directives, *made], check=True)
    flags = LIBRARY_FLAGS if name == KERNEL_LIBRARY else KERNEL_FLAGS
    return import_module("setuptools").Extension(name, [target], extra_compile_args=flags)


def loop(modules: list[str], library: str) -> list[Any]:
    """Extensions of modules that share one library, translated to C.

    Other modules are read for their types only. Their errors are no concern here, since what they
    import may be missing: the project's own check of types sees everything.
    """
    sections = [f"[mypy-{package}.*]\nignore_errors = True\n" for package in PACKAGES]
    sections += [f"[mypy-{name}]\nignore_errors = False\n" for name in modules]
    Path("mypyc.ini").write_text(MYPY_CONFIG + "\n".join(sections), encoding="utf-8")
    files = [name.replace(".", "/") + ".py" for name in modules]
    extensions: list[Any] = import_module("mypyc.build").mypycify(
        ["--config-file=mypyc.ini", "--no-site-packages", *files],
        opt_level=LOOP_LEVEL,
        debug_level="0",
        group_name=library,
        target_dir="c",
    )
    for extension in extensions:
        extension.extra_compile_args += QUIET
    return extensions


def compile_all(extensions: list[Any], folder: str) -> None:
    """Run the system's compiler, as setuptools finds it."""
    distribution = import_module("setuptools").Distribution({"ext_modules": extensions})
    command = import_module("setuptools.command.build_ext").build_ext(distribution)
    command.build_lib, command.build_temp = folder, "objects"
    command.ensure_finalized()
    command.run()


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder")
    parser.add_argument("modules", nargs="+")
    parser.add_argument("--library")
    given = parser.parse_args()
    if given.library:
        extensions = loop(given.modules, given.library)
    else:
        extensions = [kernel(name) for name in given.modules]
    compile_all(extensions, given.folder)


if __name__ == "__main__":
    main()
