"""Some units, compiled by themselves in the present folder, which holds a copy of the packages.

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
# Python's own flags have -Wall, for which gcc analyses the loop's ten megabytes for 8 of 18 s, even
# with -w.
QUIET = [] if MSVC else ["-Wno-all", "-w"]
# Square roots and comparisons compile to instructions: nothing here reads errno or traps. Rounding
# and order of operations stay Python's; no -ffast-math.
KERNEL_FLAGS = ["/O2"] if MSVC else ["-O3", "-g0", "-fno-math-errno", "-fno-trapping-math", *QUIET]
LIBRARY_FLAGS = ["/O1"] if MSVC else ["-O1", "-g0", *QUIET]  # no loop over arrays in it
# -O2 and -O3 take half as long again to compile, for no gain that can be measured in a period.
LOOP_LEVEL = "1"
MYPY_CONFIG = """
[mypy]
ignore_missing_imports = True
follow_imports = silent
"""


def kernels(names: list[str]) -> list[Any]:
    """Extensions of modules with a `.pxd`, translated to C, and of what all kernels share."""
    translate = [sys.executable, "-m", "cython", "-I", "."]
    translate += [word for key, value in DIRECTIVES.items() for word in ("-X", f"{key}={value}")]
    own = [name for name in names if name != KERNEL_LIBRARY]
    places = [name.replace(".", "/") for name in own]
    extension = import_module("setuptools").Extension
    found = []
    if own:
        sources = [f"{place}.py" for place in places]
        subprocess.run([*translate, "--shared", KERNEL_LIBRARY, *sources], check=True)
        found = [
            extension(name, [f"{place}.c"], extra_compile_args=KERNEL_FLAGS)
            for name, place in zip(own, places, strict=True)
        ]
    if KERNEL_LIBRARY in names:
        target = f"{KERNEL_LIBRARY}.c"
        subprocess.run([*translate, "--generate-shared", target], check=True)
        found.append(extension(KERNEL_LIBRARY, [target], extra_compile_args=LIBRARY_FLAGS))
    return found


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
    (whole,) = (extension for extension in extensions if extension.name == f"{library}__mypyc")
    whole.extra_compile_args += QUIET  # mypyc adds -Werror, which is for its authors
    entries = Path("c", "entries.c")
    shims = [source for other in extensions if other is not whole for source in other.sources]
    entries.write_text(_together(modules, shims), encoding="utf-8")
    whole.sources.append(str(entries))
    return [whole]


def _together(modules: list[str], shims: list[str]) -> str:
    """Where Python enters each module, in one C file: thirty extensions would take 8 s to compile.

    mypyc writes an extension for each, with one function that is named after the last part of the
    module's name, and another that is there for a linker's sake.

    Raises:
        ValueError: Two modules would have the same function.
    """
    last = [name.rpartition(".")[2] for name in modules]
    twice = {name for name in last if last.count(name) > 1}
    if twice:
        raise ValueError(f"modules of one library end in different names; twice: {sorted(twice)}")
    unused = (f"#undef PyInit___init__\n#define PyInit___init__ unused_{name}\n" for name in last)
    texts = (Path(shim).read_text(encoding="utf-8") for shim in shims)
    return "".join(f"{rename}{text}" for rename, text in zip(unused, texts, strict=True))


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
        extensions = kernels(given.modules)
    compile_all(extensions, given.folder)


if __name__ == "__main__":
    main()
