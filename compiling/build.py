"""Compile what has changed, and tell the program with a manifest.

The manifest is replaced after each batch, so that what is finished is used and stays, whatever ends
the build.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from importlib import metadata
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any
from zlib import crc32

from compiling.sources import LOOP_LIBRARY, PACKAGES, Unit, module_path, short, units

HOME = Path("shared/cohaptic/_compiled")  # of all three packages; `cohaptic.compiled` reads it
SUFFIX = EXTENSION_SUFFIXES[0]
PYTHON = SUFFIX.strip(".").rpartition(".")[0]  # as in `cohaptic.compiled`
MANIFEST = "manifest.json"
# Kernels that one process compiles: starting it takes as long as two of them.
BATCH = 6
Entry = dict[str, Any]


class CompileError(Exception):
    """Some units could not be compiled; the text is what the tools said."""


def folder(root: Path) -> Path:
    """Where the extensions for this Python lie."""
    return root / HOME / PYTHON


def stale(root: Path, *, first: bool = False) -> list[Unit]:
    """Units that were never compiled, or from other sources, or in another way.

    Args:
        root: A checkout.
        first: Only those that are compiled before all others.
    """
    recipe, known = _recipe(), _read(root)
    asked = (unit for unit in units(root) if unit.first or not first)
    return [unit for unit in asked if not _fits(unit, known.get(_key(unit, recipe)))]


def _fits(unit: Unit, entry: Entry | None) -> bool:
    return entry is not None and _tools(unit) in ("", entry.get("tools"))


def build(
    root: Path,
    *,
    first: bool = False,
    again: bool = False,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> int:
    """Compile stale units, as many at a time as there are cores, and put each in place once done.

    Whenever it is ended before, what was in place stays, and the next build goes on from there.
    Two builds of one checkout must not run at once (`compiling.alone`).

    Args:
        root: A checkout.
        first: Compile only those that are compiled before all others.
        again: Compile also what is not stale.
        progress: Called after each batch with the numbers of finished units and of all.

    Returns:
        How many units were compiled.

    Raises:
        CompileError: Not all could be compiled. Those that could are in place.
    """
    recipe, known = _recipe(), {} if again else _read(root)
    every = units(root)
    done = [unit for unit in every if _fits(unit, known.get(_key(unit, recipe)))]
    todo = [unit for unit in every if unit not in done and (unit.first or not first)]
    entries = {key: known[key] for unit in done for key in [_key(unit, recipe)]}
    folder(root).mkdir(parents=True, exist_ok=True)
    problems: list[str] = []
    with tempfile.TemporaryDirectory() as temporary, ThreadPoolExecutor(os.cpu_count()) as pool:
        pending: dict[Future[list[Entry]], list[Unit]] = {}

        def start(batch: list[Unit]) -> None:
            work = Path(tempfile.mkdtemp(dir=temporary))
            pending[pool.submit(_compile, root, batch, work, recipe)] = batch

        for batch in _batches(todo):
            start(batch)
        while pending:
            for job in wait(pending, return_when=FIRST_COMPLETED).done:
                batch = pending.pop(job)
                try:
                    made = job.result()
                except (CompileError, OSError) as error:
                    if len(batch) == 1:
                        problems.append(str(error))
                    for unit in batch if len(batch) > 1 else ():
                        start([unit])  # by itself each of them shows whether it is to blame
                    continue
                entries |= {_key(u, recipe): entry for u, entry in zip(batch, made, strict=True)}
                _write(root, every, entries, recipe)
                progress(len(entries) - len(done), len(todo))
    _tidy(root, _write(root, every, entries, recipe))
    if problems:
        # What fails for all fails for the same reason.
        more = f"\nand so could not {len(problems) - 1} more" if len(problems) > 1 else ""
        raise CompileError(problems[0] + more)
    return len(todo)


def _batches(todo: list[Unit]) -> list[list[Unit]]:
    """What one process compiles after another; the order is kept."""
    kernels = [unit for unit in todo if unit.library is None]
    return [
        *([unit] for unit in todo if unit.library is not None),
        *(kernels[i : i + BATCH] for i in range(0, len(kernels), BATCH)),
    ]


def _compile(root: Path, batch: list[Unit], work: Path, recipe: int) -> list[Entry]:
    """Compile units in a folder of their own; what the manifest says about each."""
    for unit in batch:
        _copy(root, unit, work)
    modules = [name for unit in batch for name in unit.modules]
    command = [sys.executable, "-m", "compiling.unit", "out", *modules]
    if batch[0].library is not None:
        command += ["--library", LOOP_LIBRARY]
    here = Path(__file__).resolve().parents[1]  # of this package, in whatever folder `root` is
    places = [str(here), str(root.resolve()), os.environ.get("PYTHONPATH")]
    path = os.pathsep.join(filter(None, places))
    done = subprocess.run(
        command,
        cwd=work,
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode:
        raise CompileError(f"{modules[0]} could not be compiled:\n{done.stdout[-4000:]}")
    return [_put(root, unit, work, _key(unit, recipe)) for unit in batch]


def _put(root: Path, unit: Unit, work: Path, key: str) -> Entry:
    """Copy what was built of a unit to its place; what the manifest says about it."""
    files: dict[str, int] = {}

    def put(name: str) -> str:
        built = work.joinpath("out", *name.split(".")).with_suffix(SUFFIX)
        # The name holds the key, so a running program keeps the file that it has opened.
        file = f"{name}-{key}{SUFFIX}"
        copy = folder(root) / f"{file}.{os.getpid()}"
        shutil.copyfile(built, copy)
        copy.replace(folder(root) / file)
        files[file] = built.stat().st_size
        return file

    shared = None if unit.library is None else put(unit.library)
    modules = {name: (shared or put(name), _source(root, name)) for name in unit.modules}
    entry: Entry = {"modules": modules, "files": files, "sources": unit.sources}
    entry["tools"] = _tools(unit)
    if unit.library is not None:
        entry["library"] = (unit.library, shared)
    return entry


def _copy(root: Path, unit: Unit, work: Path) -> None:
    """Copy what a unit is made from, the packages side by side.

    Of the packages' own `__init__.py` only the place is needed. What they import for type checkers
    would have mypy read half of the project.
    """
    for source in unit.sources:
        target = work / source
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.name != "__init__.py":
            shutil.copyfile(root / PACKAGES[source.partition("/")[0]] / source, target)
        for package in Path(source).parents[:-1]:
            (work / package / "__init__.py").touch()


def _source(root: Path, name: str) -> str | None:
    """What a module was made from; None for what the kernels share, which Cython makes."""
    path = module_path(root, name)
    return None if path is None else short(root, path)


def _tools(unit: Unit) -> str:
    """Modules that fit only those of the same version; empty where it is not installed."""
    if unit.group != "kernels":
        return ""
    try:
        return metadata.version("cython")
    except metadata.PackageNotFoundError:
        return ""


def _recipe() -> int:
    """Changes with the way of compiling, and with the kind of machine compiled for."""
    text = b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
    return crc32(f"{platform.machine()} {os.environ.get('ARCHFLAGS')}".encode(), crc32(text))


def _key(unit: Unit, recipe: int) -> str:
    return f"{crc32(json.dumps([unit.modules, unit.sources]).encode(), recipe):08x}"


def _read(root: Path) -> dict[str, Entry]:
    """What was finished, by the keys of units whose files are all there."""
    try:
        reported = json.loads((folder(root) / MANIFEST).read_text(encoding="utf-8"))
        return {
            entry["key"]: entry
            for group in reported["groups"].values()
            for entry in group
            if entry["key"]
            and all(
                (folder(root) / file).is_file() and (folder(root) / file).stat().st_size == size
                for file, size in entry["files"].items()
            )
        }
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def _write(root: Path, every: list[Unit], entries: dict[str, Entry], recipe: int) -> set[str]:
    """Replace the manifest at one stroke, and return the names of the files in it."""
    built = {
        name: entries[key]["files"]
        for unit in every
        for key in [_key(unit, recipe)]
        if key in entries
        for name in unit.modules
    }
    groups: dict[str, list[Entry]] = {unit.group: [] for unit in every}
    for unit in every:
        key = _key(unit, recipe)
        if key in entries and built.keys() >= set(unit.uses):
            # A module is as good as those that it is linked to.
            files = {
                **entries[key]["files"],
                **{f: n for u in unit.uses for f, n in built[u].items()},
            }
            entry = {**entries[key], "files": files, "key": key, "first": unit.first}
            groups[unit.group].append(entry)
        else:
            failed = {"modules": {name: ("", None) for name in unit.modules}, "failed": True}
            failed["first"] = unit.first
            groups[unit.group].append({**failed, "files": {}, "sources": {}, "key": ""})
    _replace(folder(root) / MANIFEST, json.dumps({"groups": groups}, indent=1))
    return {file for group in groups.values() for entry in group for file in entry["files"]}


def _tidy(root: Path, named: set[str]) -> None:
    """Delete what the manifest does not name."""
    for path in folder(root).iterdir():
        if path.name not in named | {MANIFEST}:
            try:
                path.unlink()
            except OSError:  # in use, on Windows; the next build deletes it
                continue


def _replace(path: Path, text: str) -> None:
    """Write a file that a reader finds whole, the old one or the new one."""
    new = path.with_name(f"{path.name}.{os.getpid()}")
    new.write_text(text, encoding="utf-8")
    new.replace(path)
