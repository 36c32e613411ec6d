"""Reads a triangle surface through trimesh, and merges vertices at the same coordinates."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.checked_cells import checked_cells
from cohaptic_server.objects.first_bytes import START, check_start
from cohaptic_server.objects.memory_limit import (
    reading_limited,
    say_once,
    silenced,
    unreadable,
)
from cohaptic_server.objects.surface.as_they_come import cleaned
from cohaptic_server.objects.surface.gltf import Node, read_nodes
from cohaptic_server.objects.surface.three_mf import read_three_mf

SCENES = (".glb", ".gltf")


def merge_vertices(x: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Merge vertices at the same coordinates, and drop triangles that then repeat a vertex.

    STL stores three separate vertices for every triangle; GLB and OBJ cut a surface along seams.

    Args:
        x: Vertices, shape (n, 3).
        faces: Triangles, shape (m, 3).
    """
    first, inverse = equal_points(x, 1e-8)
    faces = inverse[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    used, renumbered = np.unique(faces, return_inverse=True)
    return x[first][used], np.asarray(renumbered.reshape(-1, 3), dtype=np.int64)


def equal_points(x: Floats, fraction: float, shift: float = 0.0) -> tuple[Ints, Ints]:
    """Find points that are equal up to a share of the size of all: those in one cell of a grid.

    Args:
        shift: Shift of the grid, as a share of its cell.

    Returns:
        Index of the first point at each place, shape (k,), and the place of each point, shape (n,).
    """
    size = float(np.ptp(x, axis=0).max()) or 1.0
    cells = np.asarray((x - x.min(axis=0)) / (fraction * size) + shift, dtype=np.float64)
    return _unique_rows(np.rint(cells).astype(np.int64))


def _unique_rows(key: Ints) -> tuple[Ints, Ints]:
    """Index of the first row in each set of equal rows, (k,), and the set of each row, (n,)."""
    # Odd constants of xxHash64; products modulo 2^64 spread the bits of a row over one number.
    odd = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
    # Sorting one number for each row is twenty times as fast as sorting rows.
    mixed = (key.astype(np.uint64) * odd).sum(axis=1, dtype=np.uint64)
    _, first, inverse = np.unique(mixed, return_index=True, return_inverse=True)
    if (key[first][inverse] != key).any():  # a hash collision
        _, first, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return np.asarray(first), np.asarray(inverse).reshape(-1)


def read_surface(path: Path) -> tuple[Floats, Ints]:
    """Read vertices, shape (n, 3) in units of the file, and faces, shape (m, 3).

    glTF has metres, and a 3MF file declares its unit: their vertices are returned in metres.

    Args:
        path: A file of one of `SURFACES`.

    Raises:
        BodyError: The file is not a mesh, has no triangle, or has coordinates that are not finite.
    """
    kind = path.suffix.lower()
    with path.open("rb") as file:
        check_start(path, file.read(START))
    if kind in SCENES:
        return joined(path, read_nodes(path))
    if kind == ".3mf":
        return checked(path, *read_three_mf(path))
    x, faces, others = _by_trimesh(path, kind)
    return checked(path, x, faces, others)


def joined(path: Path, nodes: Sequence[Node]) -> tuple[Floats, Ints]:
    """One surface of all nodes of a scene, checked."""
    return checked(path, *as_one(nodes))


def as_one(nodes: Sequence[Node]) -> tuple[Floats, Ints]:
    """Vertices, shape (n, 3), and triangles, shape (m, 3), of several nodes together."""
    starts = np.cumsum([0, *(len(node.x) for node in nodes)])
    x = np.concatenate([np.zeros((0, 3)), *(node.x for node in nodes)])
    faces = [node.faces + start for node, start in zip(nodes, starts, strict=False)]
    return x, np.concatenate([np.zeros((0, 3), dtype=np.int64), *faces])


def _by_trimesh(path: Path, kind: str) -> tuple[Floats, Ints, int]:
    """Vertices and faces as trimesh reads them, and the number of points without a face."""
    import trimesh  # imported here, since a prepared object starts without trimesh

    try:
        with reading_limited(path):
            data = io.BytesIO(cleaned(path))
            with silenced("trimesh"):
                # trimesh's processing is off, since it drops coordinates that are not finite.
                scene: Any = trimesh.load_scene(  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
                    data, file_type=kind[1:], process=False
                )
                mesh: Any = scene.to_mesh()
        points = sum(len(getattr(one, "vertices", ())) for one in scene.geometry.values())
        x = np.array(mesh.vertices, dtype=np.float64).reshape(-1, 3)
        return x, np.array(mesh.faces, dtype=np.int64).reshape(-1, 3), points
    except ImportError as error:
        raise BodyError(
            f"{path}: reading {path.suffix} needs {error.name or error}; install it with:"
            " pip install 'cohaptic[objects]'"
        ) from error
    except BodyError:
        raise
    except Exception as error:  # trimesh's parsers raise errors of many kinds
        raise unreadable(path, "mesh", error) from error


def checked(path: Path, x: Floats, faces: Ints, points: int = 0) -> tuple[Floats, Ints]:
    """The surface of a file with equal vertices merged, and each triangle once.

    Points that no triangle uses are left out.

    Args:
        x: Vertices, shape (n, 3).
        faces: Triangles, shape (m, 3).
        points: Number of points that the file has beside triangles, for the error.

    Raises:
        BodyError: The triangles make no surface.
    """
    if not len(faces):
        raise BodyError(f"{path}: there is no triangle in it{_why_none(path, points)}")
    x, faces = merge_vertices(*checked_cells(path, x, faces))
    # Each triangle from its least vertex on, in its own sense of rotation.
    turned = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
    once = np.sort(_unique_rows(np.take_along_axis(faces, turned, axis=1))[0])
    if len(once) < len(faces):
        count = f"{len(faces) - len(once):,} of {len(faces):,}"
        say_once(path, f"{count} triangles are there more than once: each counts once")
    return x, faces[once]


def _why_none(path: Path, points: int) -> str:
    """What a file without triangles has instead, and the way out."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if path.suffix.lower() == ".ply" and b"element tristrips" in head.partition(b"end_header")[0]:
        return " (they are in strips, which are not read: export single triangles)"
    if not points:
        return ". Was it exported with its mesh?"
    return (
        f": it has {points:,} points, of a point cloud or a wire frame. Make a surface of them"
        " first, for example in MeshLab: Filters, Remeshing, Surface Reconstruction: Screened"
        " Poisson"
    )


_HEAD = 2**16  # bytes that are read for the header of a file
