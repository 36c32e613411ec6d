"""Use compiled modules in place of the plain Python modules (docs/design/toolchain.md).

A build compiles some modules of the packages from their Python source and leaves the extensions in
the folder `_compiled` with a manifest. `use` puts the compiled modules of one group in place of the
plain ones, which Python runs from their source. A module stays plain if its source has changed
since the build; every module stays plain if nothing was compiled. Plain modules are slower and give
the same results.

Groups:
    kernels: The server's loops over arrays; each module is compiled by itself (Cython).
    loop: The modules that compute a period of the haptic loop; they are in one library (mypyc) and
        are used together or not at all.

COHAPTIC_PLAIN=1 in the environment keeps every module plain.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from importlib.machinery import (
    EXTENSION_SUFFIXES,
    ExtensionFileLoader,
    ModuleSpec,
    SourceFileLoader,
)
from importlib.util import find_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple
from zlib import crc32

FOLDER = Path(__file__).parent / "_compiled"
PLAIN = "COHAPTIC_PLAIN"
# One folder for each Python and system, so that several can share a checkout.
PYTHON = EXTENSION_SUFFIXES[0].strip(".").rpartition(".")[0]
MANIFEST = "manifest.json"
NONE_BUILT = "no compiled modules; in a checkout, `make compiled` makes them"
UNREADABLE = "the manifest of compiled modules cannot be read"


class Place(NamedTuple):
    """The files from which Python loads one module of a group.

    Args:
        extension: Compiled file of the module.
        source: Python source, used if the system cannot load the extension. None if the module
            must not be plain, because the compiled modules of its library call each other directly.
    """

    extension: Path
    source: Path | None


class Group(NamedTuple):
    """Outcome of `use` for one group: its modules in compiled form, and why the others are plain.

    Args:
        modules: Names of the modules that are used in compiled form.
        reasons: Phrases that say why the other modules are plain.
    """

    modules: tuple[str, ...]
    reasons: tuple[str, ...]


def use(group: str, folder: Path = FOLDER) -> tuple[str, ...]:
    """Make Python import the compiled modules of a group instead of the plain ones.

    A module that has been imported before stays plain.

    Args:
        group: "kernels" or "loop".
        folder: Folder in which the build left the compiled modules.

    Returns:
        Names of the modules that Python will load in compiled form; empty if all stay plain.
    """
    if group not in _FINDER.groups:
        if _FINDER not in sys.meta_path:
            sys.meta_path.insert(0, _FINDER)
        _FINDER.groups[group] = _choose(group, folder / PYTHON)
    return _FINDER.groups[group].modules


def describe(group: str) -> str:
    """Return one line for users that says whether a group is compiled and, if not, why."""
    if group not in _FINDER.groups:
        return "plain Python: not asked for"
    modules, reasons = _FINDER.groups[group]
    if not reasons:
        return "compiled"
    return f"{'compiled, except' if modules else 'plain Python'}: {'; '.join(reasons)}"


def why_plain(group: str, folder: Path = FOLDER) -> str:
    """Return why a new process would run as plain Python what every session needs, or "".

    Modules that only some bodies need may be plain all the same; `describe` names these too.

    Args:
        group: "kernels" or "loop".
        folder: Folder in which the build left the compiled modules.
    """
    units = _units(group, folder / PYTHON)
    if isinstance(units, str):
        return units
    try:
        needed = (unit for unit in units if unit["first"])
        return next(filter(None, (_misfit(unit, folder / PYTHON) for unit in needed)), "")
    except (KeyError, TypeError, AttributeError):
        return UNREADABLE


def is_complete(group: str) -> bool:
    """Return whether every module of the group is used in its compiled form."""
    found = _FINDER.groups.get(group)
    return found is not None and not found.reasons


class _Finder:
    """Finder of the compiled modules, placed first on `sys.meta_path`; ignores other modules."""

    def __init__(self) -> None:
        self.places: dict[str, Place] = {}
        self.groups: dict[str, Group] = {}

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        place = self.places.get(name)
        if place is None:
            return None
        loader = _Loader(name, place)
        return spec_from_file_location(name, place.extension, loader=loader)

    def gave_up(self, name: str, error: Exception) -> None:
        """Record that a module's extension could not be loaded, so that the module is plain."""
        self.places.pop(name, None)
        for group, (modules, reasons) in self.groups.items():
            if name in modules:
                rest = tuple(other for other in modules if other != name)
                self.groups[group] = Group(rest, (*reasons, f"{name} cannot be loaded ({error})"))


class _Loader(ExtensionFileLoader):
    """Loader of one module: from its extension or, if the system cannot load that, its source."""

    def __init__(self, name: str, place: Place) -> None:
        super().__init__(name, str(place.extension))
        self._source = place.source

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        try:
            return super().create_module(spec)
        except ImportError as error:
            if self._source is None:
                raise
            _FINDER.gave_up(spec.name, error)
            plain = SourceFileLoader(spec.name, str(self._source))
            spec.loader, spec.origin, spec.cached = plain, str(self._source), None
            return ModuleType(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        try:
            super().exec_module(module)
        except Exception as error:  # linked to a module that has changed since the build
            if self._source is None:
                raise
            _FINDER.gave_up(module.__name__, error)
            plain = SourceFileLoader(module.__name__, str(self._source))
            module.__file__, module.__loader__ = str(self._source), plain
            if module.__spec__ is not None:
                module.__spec__.loader = plain
            plain.exec_module(module)


_FINDER = _Finder()


def _choose(group: str, folder: Path) -> Group:
    """Choose the compiled modules of a group that can be used, and register them with the finder.

    A unit of the manifest is a set of modules compiled together: one kernel, or the whole `loop`.
    """
    units = _units(group, folder)
    if isinstance(units, str):
        return Group((), (units,))
    modules: list[str] = []
    reasons: list[str] = []
    for unit in units:
        try:
            problem = _problem(unit, folder) or _enter(unit, folder)
        except (KeyError, TypeError, AttributeError):
            problem = UNREADABLE
        if problem:
            reasons.append(problem)
        else:
            # A library that several modules share has no source and is not a module of ours.
            modules += [name for name, (_, source) in unit["modules"].items() if source]
    return Group(tuple(modules), tuple(dict.fromkeys(reasons)))


def _units(group: str, folder: Path) -> list[dict[str, Any]] | str:
    """Return the units of a group in the manifest, or why there are none."""
    if os.environ.get(PLAIN, "0") not in ("", "0"):
        return f"{PLAIN} is set"
    try:
        units = json.loads((folder / MANIFEST).read_bytes())["groups"][group]
    except (OSError, ValueError, KeyError, TypeError):
        return NONE_BUILT
    return units or NONE_BUILT


def _problem(unit: dict[str, Any], folder: Path) -> str:
    """Return why this process cannot use a unit of the manifest; empty if it can."""
    for name in unit["modules"]:
        if name in sys.modules:
            return f"{name} was imported before"
    return _misfit(unit, folder)


def _misfit(unit: dict[str, Any], folder: Path) -> str:
    """Return why no process can use a unit of the manifest; empty if a new one can."""
    if unit.get("failed"):
        return f"{next(iter(unit['modules']))} was not compiled; in a checkout, `make compiled`"
    for name, size in unit["files"].items():
        path = folder / name
        if not path.is_file() or path.stat().st_size != size:
            return f"{name} is missing or damaged"
    for source, checksum in unit["sources"].items():
        path = source_path(source)
        if path is None or not path.is_file():
            return f"{source} is missing"
        if crc32(path.read_bytes()) != checksum:
            return f"{source} has changed since it was compiled; in a checkout, `make compiled`"
    return ""


def _enter(unit: dict[str, Any], folder: Path) -> str:
    """Register a unit's modules with the finder; return why the unit cannot be loaded, or ""."""
    library = unit.get("library")
    places: dict[str, Place] = {}
    for name, (file, source) in unit["modules"].items():
        alone = source_path(source) if source and library is None else None
        places[name] = Place(folder / file, alone)
    if library is not None:
        name, file = library
        places[name] = Place(folder / file, None)
        _FINDER.places[name] = places[name]
        try:
            __import__(name)
        except ImportError as error:
            del _FINDER.places[name]
            return f"{file} cannot be loaded ({error})"
    _FINDER.places.update(places)
    return ""


def source_path(source: str) -> Path | None:
    """Return the path of a source file; None if its package is not installed.

    Args:
        source: Path relative to the parent folder of the package, such as `cohaptic/vec.py`.
    """
    package, _, inside = source.partition("/")
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        return None
    return Path(next(iter(spec.submodule_search_locations))) / inside
