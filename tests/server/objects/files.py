"""Files of surfaces, for tests of what reads them."""

from __future__ import annotations

from pathlib import Path

import trimesh

from cohaptic_server.numeric import Floats, Ints


def write(path: Path, x: Floats, faces: Ints) -> Path:
    """Write a surface in the format of the path's suffix."""
    trimesh.Trimesh(x, faces, process=False).export(path)  # pyright: ignore[reportUnknownMemberType]
    return path
