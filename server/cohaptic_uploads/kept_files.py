"""The files that came and became objects, beside what was prepared of them."""

from __future__ import annotations

import contextlib
import hashlib
import re
from pathlib import Path

from cohaptic_server.objects.store.cache import cache_folder
from cohaptic_server.touchable import kind_of

MARK = "keeping"  # name of the mark, in the folder of an upload
_KEPT = 8  # files; the oldest go first


def uploads_folder() -> Path:
    """Where they are."""
    return cache_folder() / "uploads"


def keep(content: bytes, name: str, kind: str, mark: Path) -> Path:
    """Write a file where it stays; returns its path.

    Until its object is there, a file that has not been kept before has a mark: `give_up` removes
    it, also where whoever began with it was ended.

    Args:
        content: Content of the file.
        name: As the visitor has it; what of it is no letter or digit is left out.
        kind: One of `KINDS`.
        mark: Path of the mark, which the caller removes once the object is there.

    Raises:
        OSError: It cannot be written; nothing of it is left.
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
    """Remove the file that a mark names, and the mark; nothing where there is none.

    Args:
        mark: As of `keep`. A worker may have written into it whatever it likes: a name in it leads
            to no other folder.
    """
    with contextlib.suppress(OSError, ValueError):
        name, _, number = mark.read_text().partition("\n")
        path = uploads_folder() / Path(name).name
        _part(path).unlink(missing_ok=True)
        # Another server may have kept the same file meanwhile, by this name.
        if path.exists() and str(path.stat().st_ino) == number:
            path.unlink()
        mark.unlink()


def _part(path: Path) -> Path:
    """Where it is as long as it is being written."""
    return Path(f"{path}.part")


def plain_name(name: str) -> str:
    """A name of letters and digits alone, which leads to no other folder.

    Args:
        name: Whatever the visitor's file is called.
    """
    last = re.split(r"[\\/]", name)[-1]
    stem = last[: len(last) - len(kind_of(last))]
    return re.sub(r"[^A-Za-z0-9]+", "-", stem).strip("-")[:30] or "object"
