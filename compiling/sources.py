"""What there is to compile, and on which sources each part of it depends."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

# The packages, by the folder that each lies in.
PACKAGES = {"cohaptic": "shared", "cohaptic_server": "server", "cohaptic_client": "client"}
LOOP_LIBRARY = "cohaptic_loop"  # mypyc appends `__mypyc`
# What Cython needs for memoryviews, once for all kernels: each compiles in a third of the time.
KERNEL_LIBRARY = "cohaptic_cython"
# `cimport a, b`, `from a cimport b as c` and `from a cimport (b, c)`, over several lines too.
_CIMPORT = re.compile(r"^[ \t]*(?:from\s+([\w.]+)\s+)?cimport\s+(\([^)]*\)|[^\n#(]+)", re.M)


@dataclass(frozen=True, slots=True)
class Unit:
    """Modules that are compiled together, and that are used together or not at all.

    Args:
        group: What the program asks for: "kernels" or "loop" (`cohaptic.compiled`).
        modules: Names of the compiled modules.
        sources: CRC-32 of every file that the result depends on, by its path from the package on.
        library: What holds the code of all the modules; None where each holds its own.
        uses: Modules of other units that this one is linked to.
        first: Whether a demo's ticks and periods spend their time in it, so that it is compiled
            before all others.
    """

    group: str
    modules: tuple[str, ...]
    sources: dict[str, int]
    library: str | None = None
    uses: tuple[str, ...] = ()
    first: bool = True


def units(root: Path) -> list[Unit]:
    """Everything in a checkout that can be compiled, in the order in which it should be."""
    settings = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    asked = settings["tool"]["cohaptic"]["compile"]
    loop = tuple(asked["loop"])
    followed = _checksums(root, imported(root, loop).values())
    kernels = sorted(_kernels(root, asked["first"]), key=lambda unit: not unit.first)
    # The loop takes longest: what is begun last should be short.
    return [Unit("loop", loop, followed, f"{LOOP_LIBRARY}__mypyc"), *kernels]


def imported(root: Path, modules: Iterable[str]) -> dict[str, Path]:
    """Modules of ours that these import, directly or not, and themselves, with their files.

    What an `__init__.py` imports is not followed: our modules import from where a name is defined.
    """
    todo, found = list(modules), dict[str, Path]()
    while todo:
        name = todo.pop()
        path = module_path(root, name)
        if path is None or name in found:
            continue
        found[name] = path
        if "." in name:
            todo.append(name.rpartition(".")[0])
        if path.name != "__init__.py":
            todo += _imports(path)
    return found


def module_path(root: Path, name: str) -> Path | None:
    """The file of one of our modules; None where there is none, or it is not ours."""
    package, *inside = name.split(".")
    if package not in PACKAGES:
        return None
    base = root.joinpath(PACKAGES[package], package, *inside)
    files = (base.with_suffix(".py"), base / "__init__.py")
    return next((file for file in files if file.is_file()), None)


def short(root: Path, path: Path) -> str:
    """A source's path from its package on, such as `cohaptic/vec.py`."""
    return Path(*path.relative_to(root).parts[1:]).as_posix()


def _imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _kernels(root: Path, first: list[str]) -> Iterator[Unit]:
    """Each module with a declaration file beside, and before them what they share."""
    declared: dict[str, Path] = {}
    for package, folder in PACKAGES.items():
        for path in sorted((root / folder / package).rglob("*.pxd")):
            declared[short(root, path).removesuffix(".pxd").replace("/", ".")] = path
    # One without a module of its name is included in the kernels that use it.
    compiled = [name for name, path in declared.items() if path.with_suffix(".py").is_file()]
    listed = declared.keys() & first
    early = {other for name in listed for other in (name, *_cimported(name, declared))}
    if compiled:
        yield Unit("kernels", (KERNEL_LIBRARY,), {})
    for name in compiled:
        linked = _cimported(name, declared)
        files = [
            file
            for kernel in {name, *linked}
            for file in (declared[kernel], declared[kernel].with_suffix(".py"))
            if file.is_file()
        ]
        uses = (KERNEL_LIBRARY, *sorted(linked.intersection(compiled)))
        yield Unit("kernels", (name,), _checksums(root, files), uses=uses, first=name in early)


def _cimported(name: str, declared: dict[str, Path]) -> set[str]:
    """Kernels whose C types and functions this one uses, directly or not."""
    todo, found = [name], set[str]()
    while todo:
        kernel = todo.pop()
        if kernel in found:
            continue
        found.add(kernel)
        for origin, what in _CIMPORT.findall(declared[kernel].read_text(encoding="utf-8")):
            parts = [part.split()[0] for part in what.strip("() \n").split(",") if part.strip()]
            names = [origin, *(f"{origin}.{part}" for part in parts)] if origin else parts
            todo += [other for other in names if other in declared]
    return found - {name}


def _checksums(root: Path, files: Iterable[Path]) -> dict[str, int]:
    return {short(root, file): crc32(file.read_bytes()) for file in sorted(files)}
