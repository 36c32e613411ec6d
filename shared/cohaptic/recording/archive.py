"""Turns a journal into a `.npz` with bounded memory, and reads recordings in both forms."""

from __future__ import annotations

import contextlib
import zipfile
import zlib
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from cohaptic.errors import OutputError, SettingError, one_line
from cohaptic.recording.journal import LEVEL, MARK, Clocks, Header, RowBlock, entries
from cohaptic.recording.outline import Gap, Outline, extent_in_words
from cohaptic.recording.part import SUFFIX, Part, finish_command
from cohaptic.runtime.new_file import AppearedMeanwhile, write_new

Floats = npt.NDArray[np.float64]
# What reading a damaged archive, or another one, raises.
_DAMAGED = (KeyError, ValueError, TypeError, IndexError, EOFError, RuntimeError, zipfile.BadZipFile,
            zlib.error)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording in memory.

    Args:
        outline: Name, seconds, gaps and clocks.
        rows: Shape (n, columns) for n haptic periods, each as `cohaptic.status.row.Row`.
        origin: Origin of each row's frame, as a point of the scaled file of the object, shape
            (n, 3) [m].
        to_wall: Unix time less the client's clock, at the end of the recording [s].
    """

    outline: Outline
    rows: Floats
    origin: Floats
    to_wall: float


def write_archive(journal: BinaryIO, outline: Outline, file: BinaryIO) -> None:
    """Write the `.npz` of a journal.

    Args:
        journal: Journal, opened for reading in binary.
        outline: Its outline.
        file: File for the `.npz`.

    Raises:
        OSError: A file cannot be read or written.
    """
    header, clocks = outline.header, outline.clocks
    # The number of rows is that of the outline: a journal may grow while it is read.
    members = {
        "columns": np.array(header.columns),
        "name": np.array(header.name),
        "loop_hz": np.array(header.loop_hz),
        "rules": np.array(list(header.rules.items()), dtype=np.str_).reshape(-1, 2),
        "to_wall": np.array(clocks[-1].to_wall if clocks else np.nan),
        "to_wall_begin": np.array(clocks[0].to_wall if clocks else np.nan),
        "clocks": np.array(clocks, dtype=np.float64).reshape(-1, len(Clocks._fields)),
        "clock_columns": np.array(Clocks._fields),
        "gaps": np.array(outline.gaps, dtype=np.float64).reshape(-1, 2),
    }
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive:
        for name, value in members.items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, value, allow_pickle=False)
        for name, width in (("rows", len(header.columns)), ("origin", 3)):
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                about = {
                    "descr": "<f8", "fortran_order": False, "shape": (outline.count, width),
                }  # fmt: skip
                np.lib.format.write_array_header_1_0(member, about)
                for block in _blocks(journal, outline):
                    count = len(block.rows) // (8 * len(header.columns))
                    data = np.tile(np.array(block.origin), count).tobytes()
                    member.write(block.rows if name == "rows" else data)


def _blocks(journal: BinaryIO, outline: Outline) -> Generator[RowBlock, None, None]:
    """Yield the blocks of rows that the outline has counted."""
    left = outline.count * 8 * len(outline.header.columns)
    for entry in entries(journal):
        if isinstance(entry, RowBlock) and left > 0:
            left -= len(entry.rows)
            yield entry


def finish(part: Part, path: Path, *, overwrite: bool, least: int = 0) -> Outline:
    """Turn a part into a `.npz`, and remove it if all of it could be read.

    Args:
        part: Part that this process owns; it is closed.
        path: Path of the `.npz`.
        overwrite: Whether to replace a file of that name.
        least: Number of rows that were written; with fewer the part remains.

    Returns:
        The outline of the recording.

    Raises:
        OutputError: The `.npz` cannot be written, or another file has its name; the part remains.
        SettingError: The part is no journal.
    """
    try:
        with part.path.open("rb") as journal:
            outline = _outline(part.path, journal)
            write_new(path, lambda file: write_archive(journal, outline, file), overwrite=overwrite)
        if outline.intact and outline.count >= least:
            part.remove()
    except (OutputError, OSError) as error:
        if isinstance(error, AppearedMeanwhile):  # the part holds the same
            error.written.unlink(missing_ok=True)
        problem = error.problem if isinstance(error, OutputError) else f"{error.strerror or error}"
        kept = f"the recording is kept as {part.path}; later turn it into a .npz by: "
        raise OutputError(path, problem, kept + finish_command(part.path)) from error
    finally:
        part.close()
    return outline


def read_outline(path: Path) -> Outline:
    """Return what a recording holds besides its rows, with bounded memory if it is a part.

    Raises:
        SettingError: The file cannot be read, or is no recording.
    """
    with _opened(path) as file:
        return _read_archive(path).outline if _is_archive(file) else _outline(path, file)


def read_recording(path: Path) -> Recording:
    """Read a recording: a `.npz`, or the part of one in progress or of a killed process.

    Raises:
        SettingError: The file cannot be read, or is no recording.
    """
    with _opened(path) as file:
        if _is_archive(file):
            return _read_archive(path)
        outline = _outline(path, file)
        blocks = list(_blocks(file, outline))
    width = len(outline.header.columns)
    rows = np.frombuffer(b"".join(block.rows for block in blocks)).reshape(-1, width)
    counts = [len(block.rows) // (8 * width) for block in blocks]
    points = np.array([block.origin for block in blocks]).reshape(-1, 3)
    to_wall = outline.clocks[-1].to_wall if outline.clocks else np.nan
    return Recording(outline, rows, np.repeat(points, counts, axis=0), to_wall)


@contextlib.contextmanager
def _opened(path: Path) -> Generator[BinaryIO, None, None]:
    """Open a file for reading; a pipe would keep the reader waiting.

    Raises:
        SettingError: It cannot be read.
    """
    try:
        if path.exists() and not path.is_file():
            raise SettingError("recording", path, "a file")
        with path.open("rb") as file:
            yield file
    except OSError as error:
        limit = f"a file to read ({error.strerror or error})"
        raise SettingError("recording", path, limit) from error


def _is_archive(file: BinaryIO) -> bool:
    return file.read(2) == b"PK"


def _outline(path: Path, journal: BinaryIO) -> Outline:
    """Return the outline of a journal.

    Raises:
        SettingError: The file is no journal.
    """
    journal.seek(0)
    start = journal.read(len(MARK))
    outline = Outline.of(entries(journal))
    if start != MARK[: len(start)] and not (outline.count or outline.clocks):
        raise SettingError("recording", path, "a .npz of `cohaptic touch --record`, or its .part")
    return outline


def _read_archive(path: Path) -> Recording:
    """Read a `.npz`; one of an earlier version has fewer entries.

    Raises:
        SettingError: It is no recording.
    """
    try:
        with np.load(path) as file:
            columns = tuple(map(str, file["columns"].tolist()))
            rows, to_wall = file["rows"], float(file["to_wall"])
            rules = dict(file["rules"].tolist()) if "rules" in file else {}
            outline = Outline(Header(str(file["name"]), columns, 0.0, rules))
            outline.add_times(rows.reshape(-1, len(columns))[:, 0].astype(np.float64))
            if "clocks" in file:
                clocks = file["clocks"].reshape(-1, len(Clocks._fields))
                outline.clocks = [Clocks(*values) for values in clocks.tolist()]
                outline.gaps = [Gap(*values) for values in file["gaps"].reshape(-1, 2).tolist()]
            return Recording(outline, rows, file["origin"], to_wall)
    except _DAMAGED as error:
        raise SettingError("recording", path, "a .npz of `cohaptic touch --record`") from error


def in_words(outline: Outline) -> str:
    """Return how long a recording is, whose it is and what it lacks, in one line."""
    return f"{one_line(outline.header.name)}: {extent_in_words(outline)}"


def name_of(part: Path) -> Path:
    """Return the path of the `.npz` of a part.

    Raises:
        SettingError: It does not have the name of a part.
    """
    if part.suffix != SUFFIX:
        raise SettingError("recording", part, f"a file that ends with {SUFFIX}, to be finished")
    return part.with_suffix("")
