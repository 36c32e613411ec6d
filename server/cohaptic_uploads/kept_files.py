"""Stores uploaded files that become objects in the cache, beside the prepared objects."""

from __future__ import annotations

import contextlib
import hashlib
import re
from pathlib import Path

from cohaptic_server.objects.store.cache import cache_folder
from cohaptic_server.touchable import kind_of

MARK = "keeping"  # name of the mark file in the folder of an upload
_KEPT = 8  # files; the oldest are removed first


def uploads_folder() -> Path:
    """Folder of the kept files."""
    return cache_folder() / "uploads"


def keep(content: bytes, name: str, kind: str, mark: Path) -> Path:
    """Write a file into the folder of kept files; returns its path.

    For a new file this function also writes a mark file with its name. The mark stays until the
    object is prepared, so that `give_up` can remove the file even if the worker was killed.

    Args:
        content: Content of the file.
        name: Name of the visitor's file; only its letters and digits are used.
        kind: Kind of the file, one of `KINDS`.
        mark: Path of the mark, which the caller removes when the object is prepared.

    Raises:
        OSError: The file cannot be written; no part of it is left.
    """
    folder = uploads_folder()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    digest = hashlib.sha256(content).hexdigest()[:8]
    path = folder / f"{plain_name(name)}-{digest}{kind}"
    part, new = _part(path), not path.exists()
    if new:
        mark.write_text(f"{path.name}\n")
    try:
        part.write_bytes(content)
        if new:
            mark.write_text(f"{path.name}\n{part.stat().st_ino}")
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise
    kept = sorted(folder.iterdir(), key=lambda file: file.stat().st_mtime)
    for old in kept[: max(0, len(kept) - _KEPT)]:
        old.unlink(missing_ok=True)
    return path


def give_up(mark: Path) -> None:
    """Remove the file that a mark names, and the mark; do nothing without a mark.

    Args:
        mark: Path of the mark, as for `keep`. Folders in the name that it contains are ignored,
            since a faulty worker may write anything into the mark.
    """
    with contextlib.suppress(OSError, ValueError):
        name, _, number = mark.read_text().partition("\n")
        path = uploads_folder() / Path(name).name
        _part(path).unlink(missing_ok=True)
        # Another server may have kept the same file under this name meanwhile.
        if path.exists() and str(path.stat().st_ino) == number:
            path.unlink()
        mark.unlink()


def _part(path: Path) -> Path:
    """Temporary path of a file while it is being written."""
    return Path(f"{path}.part")


def plain_name(name: str) -> str:
    """Reduce a file name to letters, digits and hyphens, so that it cannot name another folder.

    Args:
        name: Name of the visitor's file, as the visitor gives it.
    """
    last = re.split(r"[\\/]", name)[-1]
    stem = last[: len(last) - len(kind_of(last))]
    return re.sub(r"[^A-Za-z0-9]+", "-", stem).strip("-")[:30] or "object"
