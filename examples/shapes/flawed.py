"""Surfaces as real files have them: open, crossing, hollow, doubled, flipped, in other units."""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.icosphere import icosphere
from shapes.grids import Mesh, joined, moved, square, standing, thickened, turned
from shapes.solids import ball, cube, knot, torus


def open_ball() -> Mesh:
    """A ball with one hole at its top."""
    x, faces = ball()
    return x, faces[x[faces][:, :, 2].mean(axis=1) < 0.092]


def crossing() -> Mesh:
    """Two balls that pass through each other, put into one file without a union."""
    return joined([ball(), moved(ball(), (0.06, 0.013, 0.007))])


def nested() -> Mesh:
    """A hollow ball: a smaller one within, turned inside out."""
    x, faces = icosphere(3, 0.03)
    return joined([ball(), (x + np.array([0.0, 0.0, 0.05]), faces[:, ::-1])])


def tiny() -> Mesh:
    """A torus of 5 mm."""
    return moved(torus(), (0.0, 0.0, 0.0), 0.005 / 0.17)


def huge() -> Mesh:
    """A torus of 170 mm, written in millimetres."""
    return moved(torus(), (0.0, 0.0, 0.0), 1000.0)


def sheet() -> Mesh:
    """A wavy sheet without thickness."""
    x, faces = square(40, 0.2)
    wave = 0.012 * np.sin(40.0 * x[:, 0]) * np.cos(30.0 * x[:, 1])
    return x + np.stack([0.0 * wave, 0.0 * wave, wave], axis=1), faces


def bowl() -> Mesh:
    """The lower half of a ball, open at its top and without thickness."""
    polar = np.linspace(-0.5 * np.pi, 0.0, 17)
    profile = 0.08 * np.stack([np.cos(polar), 1.0 + np.sin(polar)], axis=1)
    profile[0, 0] = 0.0
    return turned(profile, 48)


def pile() -> Mesh:
    """Twenty cubes that reach into each other, as parts of an assembly do."""
    rng = np.random.default_rng(2)
    cubes: list[Mesh] = []
    for k in range(20):
        i, j, level = k % 3, k // 3 % 3, k // 9
        q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        turn = q * np.sign(np.linalg.det(q))
        x, faces = cube(0.05)
        centre = np.array([0.04 * i, 0.04 * j, 0.04 * level])
        cubes.append(((x - np.array([0.0, 0.0, 0.025])) @ turn.T + centre, faces))
    return standing(joined(cubes))


def scattered() -> Mesh:
    """Twenty cubes apart from each other."""
    places = [(0.05 * (k % 5), 0.05 * (k // 5), 0.0) for k in range(20)]
    return joined([moved(cube(0.03), place) for place in places])


def touching() -> Mesh:
    """Two cubes that share an edge, at which four triangles meet."""
    return joined([cube(), moved(cube(), (0.08, 0.08, 0.0))])


def pinched() -> Mesh:
    """A knot whose tube is so thick that it touches itself and passes a little through itself."""
    return knot(tube=0.026)


def duplicate() -> Mesh:
    """A ball with a tenth of its triangles there twice."""
    x, faces = ball()
    return x, np.concatenate([faces, faces[::10]])


def flipped() -> Mesh:
    """A ball with a third of its triangles facing inwards."""
    x, faces = ball()
    turned_over = np.random.default_rng(3).random(len(faces)) < 1.0 / 3.0
    return x, np.where(turned_over[:, None], faces[:, ::-1], faces)


def inside_out() -> Mesh:
    """A torus that faces inwards everywhere."""
    x, faces = torus()
    return x, faces[:, ::-1]


def leaflet() -> Mesh:
    """A sheet 1 mm thick and 0.2 m wide: thinner than a mesh of it can resolve."""
    return standing(thickened(sheet(), 0.001))
