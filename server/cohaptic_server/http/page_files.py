"""Reads the files of the page when the server starts; the server serves no other file."""

from __future__ import annotations

import gzip
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "page"  # built by `make page`
INDEX = "/index.html"

_TEXT = {
    ".css": "text/css",
    ".html": "text/html",
    ".js": "text/javascript",
    ".json": "application/json",
    ".map": "application/json",
    ".svg": "image/svg+xml",
    ".txt": "text/plain",
    ".webmanifest": "application/manifest+json",
}
_UNKNOWN = "application/octet-stream"
_BINARY = {".ico": "image/x-icon", ".png": "image/png", ".wasm": "application/wasm"}


@dataclass(frozen=True, slots=True)
class PageFile:
    """One file of the page.

    Args:
        kind: Media type.
        body: Content.
        gzipped: Content compressed by gzip; None if that is not shorter or the file is binary.
        hashed: Whether the name contains a hash of the content, which then never changes.
    """

    kind: str
    body: bytes
    gzipped: bytes | None
    hashed: bool


def load_page(folder: Path = FOLDER) -> dict[str, PageFile]:
    """All files of the page by path on the server; empty if the page was not built."""
    if not (folder / INDEX[1:]).is_file():
        return {}
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {f"/{path.relative_to(folder).as_posix()}": _file(path, folder) for path in files}


def has_page(page: Mapping[str, PageFile]) -> bool:
    """Whether the page was built."""
    return INDEX in page


def _file(path: Path, folder: Path) -> PageFile:
    body = path.read_bytes()
    text = _TEXT.get(path.suffix)
    kind = f"{text}; charset=utf-8" if text else _BINARY.get(path.suffix, _UNKNOWN)
    gzipped = gzip.compress(body, mtime=0) if text else None
    # Vite writes files with a hash in their name into this folder.
    hashed = path.relative_to(folder).parts[0] == "assets"
    return PageFile(
        kind, body, gzipped if gzipped is not None and len(gzipped) < len(body) else None, hashed
    )
