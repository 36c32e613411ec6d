"""A surface from a file: what trimesh reads, with corners that lie together made one."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from cohaptic.errors import BodyError, one_line
from cohaptic_server.numeric import Floats, Ints

SURFACES = (".stl", ".obj", ".ply", ".glb", ".gltf", ".3mf", ".off")


def read_surface(path: Path) -> tuple[Floats, Ints]:
    """Vertices (n, 3), in the units of the file, and faces (m, 3).

    Raises:
        BodyError: Not a mesh, nothing in it, or coordinates that are no numbers.
    """
    trimesh_log = logging.getLogger("trimesh")
    was, trimesh_log.disabled = trimesh_log.disabled, True  # its news are told in our words
    try:
        # No other processing: it drops what is no number, and the user should know of it.
        loaded: Any = trimesh.load(  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
            path, force="mesh", process=False
        )
        x = np.array(loaded.vertices, dtype=np.float64).reshape(-1, 3)
        faces = np.array(loaded.faces, dtype=np.int64).reshape(-1, 3)
    except ImportError as error:
        raise BodyError(
            f"{path}: reading {path.suffix} needs {error.name or error}; install it with:"
            " pip install 'cohaptic[objects]'"
        ) from error
    except Exception as error:  # trimesh raises whatever its parsers meet
        words = one_line(f"{type(error).__name__}: {error}")
        raise BodyError(f"{path}: this is no mesh that can be read ({words})") from error
    finally:
        trimesh_log.disabled = was
    if not len(faces):
        raise BodyError(f"{path}: there is no triangle in it ({len(x)} vertices)")
    if faces.min() < 0 or faces.max() >= len(x):
        raise BodyError(f"{path}: a triangle names vertex {faces.max()} of {len(x)}")
    bad = ~np.isfinite(x).all(axis=1)
    if bad.any():
        raise BodyError(
            f"{path}: {bad.sum()} of {len(x)} vertices have a coordinate that is not a number"
        )
    return merged(x, faces)


def merged(x: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """One vertex for all corners at one place; triangles that this leaves without area go.

    STL has three corners of its own for every triangle, GLB and OBJ cut a surface along seams.
    """
    size = float(np.ptp(x, axis=0).max()) or 1.0
    key = np.round(x / (1e-8 * size)).astype(np.int64)
    first, which = _places(key)
    faces = which.reshape(-1)[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    used, renamed = np.unique(faces, return_inverse=True)
    return x[first][used], np.asarray(renamed.reshape(-1, 3), dtype=np.int64)


def _places(key: Ints) -> tuple[Ints, Ints]:
    """First row of each place, shape (k,), and the place of each row, shape (n,)."""
    odd = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
    # One number for a row: sorting rows takes twenty times as long, a minute for millions.
    mixed = (key.astype(np.uint64) * odd).sum(axis=1, dtype=np.uint64)
    _, first, which = np.unique(mixed, return_index=True, return_inverse=True)
    if (key[first][which] != key).any():  # two places with one number
        _, first, which = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return np.asarray(first), np.asarray(which).reshape(-1)
