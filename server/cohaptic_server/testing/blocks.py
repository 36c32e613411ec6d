"""Tetrahedral test meshes: a block, and a half ball that stands in for a half space."""

from __future__ import annotations

import itertools

import numpy as np

from cohaptic_server.mesh.tetrahedra import TetMesh, boundary
from cohaptic_server.numeric import Floats, Ints

_GRADING = 1.8  # exponent that moves layers of the core towards its face


def grid(xs: Floats, ys: Floats, zs: Floats) -> TetMesh:
    """Make a mesh of a box from a grid, with six tetrahedra in each cell.

    The tetrahedra of a cell share the diagonal that points away from the axis x = y = 0.

    Args:
        xs, ys, zs: Rising positions of the planes across x, y and z [m].
    """
    shape = (len(xs), len(ys), len(zs))
    x = np.stack(np.meshgrid(xs, ys, zs, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(x)).reshape(shape)
    cells = np.stack(np.meshgrid(*(np.arange(k - 1) for k in shape), indexing="ij"), axis=-1)
    cells = cells.reshape(-1, 3)
    # Cells are mirrored at the middle, so that the faces between neighbours agree.
    flip = np.stack(
        [xs[cells[:, 0] + 1] <= 0.0, ys[cells[:, 1] + 1] <= 0.0, np.zeros(len(cells), dtype=bool)],
        axis=1,
    )
    tets: list[Ints] = []
    for order in itertools.permutations(range(3)):
        corner = np.zeros_like(cells)
        path = [corner]
        for axis in order:
            corner = corner.copy()
            corner[:, axis] = 1
            path.append(corner)
        corners = [cells + np.where(flip, 1 - c, c) for c in path]
        tets.append(np.stack([number[tuple(p.T)] for p in corners], axis=1))
    return TetMesh.checked(x, np.concatenate(tets))


def block(size: tuple[float, float, float], cells: tuple[int, int, int]) -> TetMesh:
    """Make a block that stands on z = 0, its foot centred on the origin.

    Args:
        size: Length along x, y, z [m].
        cells: Number of cells along x, y, z.
    """
    (lx, ly, lz), (nx, ny, nz) = size, cells
    xs, ys = np.linspace(-0.5 * lx, 0.5 * lx, nx + 1), np.linspace(-0.5 * ly, 0.5 * ly, ny + 1)
    return grid(xs, ys, np.linspace(0.0, lz, nz + 1))


def half_ball(core: Floats, shells: Floats) -> TetMesh:
    """Make a half ball below z = 0 that approximates a half space, fine near its centre.

    The core is a grid of cubes projected radially, cube k onto the half sphere of radius `core[k]`;
    the shells continue the core's triangles outwards, each with the same number of elements.

    Args:
        core: Rising radii of the layers of the core, the first of them 0, shape (k + 1,) [m].
        shells: Rising radii of the shells beyond the core, shape (s,) [m].
    """
    k = len(core) - 1
    line = np.arange(-k, k + 1, dtype=np.float64)
    cube = grid(line, line, np.arange(0, k + 1, dtype=np.float64))
    ring = np.abs(cube.vertices).max(axis=1).round().astype(np.int64)
    # Layers are closer together under the face: the stress at the edge of a punch is singular.
    bent = cube.vertices.copy()
    bent[:, 2] *= (bent[:, 2] / np.maximum(ring, 1)) ** (_GRADING - 1.0)
    length = np.linalg.norm(bent, axis=1)
    unit = bent / np.where(length > 0.0, length, 1.0)[:, None]
    layers, tets = [unit * core[ring][:, None]], [cube.tets]
    outer = np.flatnonzero(ring == k)
    skin = boundary(cube.tets)
    # Corners in rising order cut neighbouring prisms along the same diagonals.
    skin = np.sort(np.searchsorted(outer, skin[(ring[skin] == k).all(axis=1)]), axis=1)
    below, start = outer, len(unit)
    for radius in shells.tolist():
        above = start + np.arange(len(outer))
        start += len(outer)
        layers.append(radius * unit[outer])
        (a, b, c), (d, e, f) = below[skin].T, above[skin].T
        tets += [np.stack(t, axis=1) for t in ((a, b, c, f), (a, b, e, f), (a, d, e, f))]
        below = above
    return TetMesh.checked(
        np.concatenate(layers) * np.array([1.0, 1.0, -1.0]), np.concatenate(tets)
    )
