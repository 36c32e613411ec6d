"""Tetrahedra of objects kept on disk, so that the second start is quick.

The key is the content: the bytes of the file and everything that decides what they become. A stored
object that cannot be read is made anew. Nothing is read from it but arrays of numbers.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import zipfile
import zlib
from dataclasses import astuple
from pathlib import Path

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.bodies.tetrahedra import TetMesh
from cohaptic_server.objects.object_file import ObjectFile, Prepared, prepare
from cohaptic_server.objects.surface_checks import SurfaceReport

_FORM = 2  # raised when what is stored, or how it is made, changes


def folder() -> Path:
    """Where this system keeps what can be made anew; COHAPTIC_CACHE chooses another place."""
    chosen = os.environ.get("COHAPTIC_CACHE")
    if chosen:
        return Path(chosen)
    home = Path.home()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData/Local")
    elif sys.platform == "darwin":
        base = home / "Library/Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "cohaptic"


def place(wanted: ObjectFile) -> Path:
    """File of a stored object; the file that it comes from must be there."""
    words = (_FORM, wanted.path.suffix.lower(), wanted.scale, wanted.edge, wanted.repair)
    key = hashlib.sha256(repr(words).encode() + wanted.path.read_bytes()).hexdigest()
    return folder() / f"{key[:32]}.npz"


def prepared(wanted: ObjectFile) -> Prepared:
    """From the store, or made and stored; raises as `object_file.prepare`."""
    if not wanted.path.is_file():
        return prepare(wanted)  # which says what is wrong
    where = place(wanted)
    found = _read(where)
    if found is None:
        found = prepare(wanted)
        _write(where, found)
    return found


def _read(where: Path) -> Prepared | None:
    try:
        # Opened here: numpy leaves a damaged file open.
        with where.open("rb") as file, np.load(file, allow_pickle=False) as data:
            tets = TetMesh.checked(
                np.asarray(data["vertices"], dtype=np.float64),
                np.asarray(data["tets"], dtype=np.int64),
            )
            report = data["report"].tolist()
    except (OSError, ValueError, KeyError, EOFError, BodyError, zipfile.BadZipFile, zlib.error):
        return None  # not there, or damaged
    if len(report) != 6:
        return Prepared(tets, None)
    counts = (int(value) for value in report[:4])
    return Prepared(tets, SurfaceReport(*counts, *report[4:]))


def _write(where: Path, what: Prepared) -> None:
    """At once or not at all; a store that cannot be written costs time, and nothing else."""
    report = () if what.surface is None else astuple(what.surface)
    try:
        where.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=where.parent, suffix=".part", delete=False) as file:
            np.savez(
                file,
                vertices=what.tets.vertices,
                tets=what.tets.tets,
                report=np.array(report, dtype=np.float64),
            )
        os.replace(file.name, where)
    except OSError:
        return
