"""Triangles of regular grids: closed tubes, turned profiles, thick plates, star shapes.

Every closed surface faces outwards and is in one piece.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cohaptic_server.numeric import Floats, Ints

Mesh = tuple[Floats, Ints]


def periodic(rows: int, columns: int) -> Ints:
    """Triangles of a grid that closes on itself both ways, shape (2 rows columns, 3).

    They face outwards where rows run counter-clockwise about z, and columns from the outside up.

    Args:
        rows: Number of rows; vertex (i, j) is `i * columns + j`.
        columns: Number of columns.
    """
    i, j = (k.ravel() for k in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    row, next_row = i * columns, (i + 1) % rows * columns
    next_column = (j + 1) % columns
    faces = [
        (row + j, next_row + j, next_row + next_column),
        (row + j, next_row + next_column, row + next_column),
    ]
    return np.concatenate([np.stack(face, axis=1) for face in faces])


def turned(profile: Floats, around: int) -> Mesh:
    """The surface that a profile makes as it turns about z, closed where both ends lie on the axis.

    Args:
        profile: Distance from the axis and height, shape (m, 2) [m], the lower outside end first;
            its first point lies on the axis.
        around: Number of vertices round the axis.
    """
    closes = bool(profile[-1, 0] == 0.0)
    body = profile[1:-1] if closes else profile[1:]
    m = len(body)
    angle = 2.0 * np.pi * np.arange(around) / around
    rings = np.stack(
        [
            np.outer(np.cos(angle), body[:, 0]),
            np.outer(np.sin(angle), body[:, 0]),
            np.broadcast_to(body[:, 1], (around, m)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    ends = [[0.0, 0.0, profile[0, 1]], *([[0.0, 0.0, profile[-1, 1]]] if closes else [])]
    i = np.arange(around)
    here, there = i * m, (i + 1) % around * m
    bottom = around * m
    fans = [np.stack([np.full(around, bottom), there, here], axis=1)]
    for k in range(m - 1):
        fans.append(np.stack([here + k, there + k, there + k + 1], axis=1))
        fans.append(np.stack([here + k, there + k + 1, here + k + 1], axis=1))
    if closes:
        fans.append(np.stack([np.full(around, bottom + 1), here + m - 1, there + m - 1], axis=1))
    return np.concatenate([rings, np.array(ends)]), np.concatenate(fans)


def star(radius: Callable[[Floats], Floats], around: int, across: int) -> Mesh:
    """A closed surface at a distance from the origin in each direction; it cannot cross itself.

    It has 2 around (across - 1) triangles.

    Args:
        radius: Distance of the surface in unit directions (n, 3), shape (n,) [m].
        around: Meridians.
        across: Intervals from pole to pole.
    """
    polar = np.linspace(-0.5 * np.pi, 0.5 * np.pi, across + 1)
    profile = np.stack([np.cos(polar), np.sin(polar)], axis=1)
    profile[[0, -1], 0] = 0.0
    direction, faces = turned(profile, around)
    return direction * radius(direction)[:, None], faces


def square(cells: int, size: float) -> Mesh:
    """An open square in the plane z = 0 about the origin, that faces up.

    Args:
        cells: Along each side.
        size: Length of a side [m].
    """
    line = np.linspace(-0.5 * size, 0.5 * size, cells + 1)
    x, y = np.meshgrid(line, line, indexing="ij")
    i, j = (k.ravel() for k in np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij"))
    n = cells + 1
    a, b, c, d = i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.stack([x.ravel(), y.ravel(), np.zeros(n * n)], axis=1), faces


def thickened(mesh: Mesh, thickness: float) -> Mesh:
    """A closed body between an open surface and the same one lower along z.

    Args:
        mesh: An open surface that faces up.
        thickness: Along z [m].
    """
    x, faces = mesh
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    there = {(int(a), int(b)) for a, b in edges}
    rim = np.array([(a, b) for a, b in sorted(there) if (b, a) not in there])
    n = len(x)
    a, b = rim.T
    sides = [np.stack([b, a, a + n], axis=1), np.stack([b, a + n, b + n], axis=1)]
    below = x - np.array([0.0, 0.0, thickness])
    return np.concatenate([x, below]), np.concatenate([faces, faces[:, ::-1] + n, *sides])


def joined(meshes: list[Mesh]) -> Mesh:
    """Several surfaces in one mesh, with nothing merged."""
    starts = np.cumsum([0, *(len(x) for x, _ in meshes)])
    faces = [f + start for (_, f), start in zip(meshes, starts, strict=False)]
    return np.concatenate([x for x, _ in meshes]), np.concatenate(faces)


def moved(mesh: Mesh, by: tuple[float, float, float], scale: float = 1.0) -> Mesh:
    """The mesh, scaled about the origin and then moved by a vector [m]."""
    return scale * mesh[0] + np.array(by), mesh[1]


def standing(mesh: Mesh) -> Mesh:
    """The mesh, moved up or down until it stands on z = 0."""
    return mesh[0] - np.array([0.0, 0.0, mesh[0][:, 2].min()]), mesh[1]
