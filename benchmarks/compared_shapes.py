"""Ten shapes over whose surface the stiffness varies strongly.

Plates bend, limbs bend the more the nearer to their tips, fins and ears are thinner than a
fingertip is wide, and what is held stiffens its surroundings. Blocks are cut into tetrahedra
directly; the others are closed surfaces, some of which overlap or lie in each other, and fTetWild
fills them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats, Ints, Mask
from cohaptic_server.objects.tetrahedralise import tetrahedralise
from cohaptic_server.testing.blocks import block
from cohaptic_server.testing.soft_ring import RING, TUBE

Surface = tuple[Floats, Ints]  # vertices (n, 3) [m] and triangles (m, 3)
Point = tuple[float, float, float]

_FIXED = 0.1  # share of the height, at the bottom, that is held


@dataclass(frozen=True, eq=False)
class Shape:
    """An object to press on.

    Args:
        tets: At rest.
        fixed: Vertices that do not move, shape (n,).
        settings: Material and elements.
    """

    tets: TetMesh
    fixed: Mask
    settings: SolidSettings


def thin_plate() -> Shape:
    """200 x 150 x 3 mm, clamped along a short side."""
    tets = block((0.2, 0.15, 0.003), (24, 18, 1))
    return Shape(tets, tets.vertices[:, 0] < -0.0999, SolidSettings())


def box() -> Shape:
    """100 x 80 x 60 mm, its foot held."""
    tets = block((0.1, 0.08, 0.06), (9, 8, 6))
    return Shape(tets, tets.vertices[:, 2] <= 0.0, SolidSettings())


def rod() -> Shape:
    """300 x 20 x 20 mm, clamped at one end."""
    tets = block((0.3, 0.02, 0.02), (45, 3, 3))
    return Shape(tets, tets.vertices[:, 0] < -0.1499, SolidSettings())


def noisy_ball() -> Shape:
    """A ball of 50 mm whose radius is random by 6 %, as that of a bad scan."""
    x, faces = _ball(0.05)
    noise = np.random.default_rng(4).normal(0.0, 0.06, len(x))
    return _filled(((1.0 + noise)[:, None] * x, faces), edge=0.06)


def hollow_ball() -> Shape:
    """A ball of 50 mm with a cavity, its wall of 6 to 14 mm."""
    x, faces = _ball(0.04, (0.0, 0.0, 0.004))
    return _filled(_ball(0.05), (x, faces[:, ::-1]), edge=0.05)


def animal() -> Shape:
    """Trunk, head, tail and four legs of overlapping blobs; it stands on its feet."""
    feet = [(x, y) for x in (-0.05, 0.05) for y in (-0.02, 0.02)]
    legs = [_ball(0.008, (x, y, -0.045), (1.0, 1.0, 4.5)) for x, y in feet]
    head = [_ball(0.016, (0.085, 0.0, 0.022)), _ball(0.009, (0.075, 0.0, 0.012), (2.0, 1.0, 1.5))]
    tail = _ball(0.006, (-0.1, 0.0, 0.01), (6.0, 1.0, 1.0))
    return _filled(_ball(0.03, axes=(2.5, 1.0, 0.8)), *legs, *head, tail, edge=0.04)


def torus() -> Shape:
    """A ring on its edge, so that its far side sways."""
    u, v = np.meshgrid(*(2.0 * np.pi * np.arange(n) / n for n in (60, 28)), indexing="ij")
    out = RING + TUBE * np.cos(v)
    x = np.stack([out * np.cos(u), TUBE * np.sin(v), out * np.sin(u)], axis=-1).reshape(-1, 3)
    a = np.arange(len(x)).reshape(u.shape)
    b, c, d = np.roll(a, -1, 0), np.roll(a, -1, (0, 1)), np.roll(a, -1, 1)
    faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, d, c), (a, c, b))])
    return _filled((x, faces), edge=0.05)


def tiny_ball() -> Shape:
    """A ball of 6 mm across, less than a fingertip."""
    return _filled(_ball(0.003), edge=0.06)


def huge_pear() -> Shape:
    """4 m high and stiff."""
    return _filled(_ball(1.0), _ball(0.45, (0.0, 0.0, 1.2), (1.0, 1.0, 3.0)), edge=0.05, young=1e6)


def ears() -> Shape:
    """A head with two ears, each a disc of 4 mm."""
    sides = [_ball(0.028, (0.0, y, 0.05), (0.08, 0.8, 1.4)) for y in (-0.03, 0.03)]
    return _filled(_ball(0.04), *sides, edge=0.035)


SHAPES: dict[str, Callable[[], Shape]] = {
    "thin plate": thin_plate,
    "noisy ball": noisy_ball,
    "hollow ball": hollow_ball,
    "animal": animal,
    "torus": torus,
    "tiny ball": tiny_ball,
    "huge pear": huge_pear,
    "box": box,
    "rod": rod,
    "ears": ears,
}


def _ball(radius: float, centre: Point = (0.0, 0.0, 0.0), axes: Point = (1.0, 1.0, 1.0)) -> Surface:
    """An ellipsoid of half axes `radius` times `axes`."""
    x, faces = icosphere(3, radius)
    return x * np.array(axes) + np.array(centre), faces


def _filled(*pieces: Surface, edge: float, young: float = 2e4) -> Shape:
    """The union of closed surfaces, without what those turned inside out enclose."""
    starts = np.cumsum([0, *(len(x) for x, _ in pieces[:-1])])
    x = np.concatenate([x for x, _ in pieces])
    faces = np.concatenate([f + k for (_, f), k in zip(pieces, starts.tolist(), strict=True)])
    tets = tetrahedralise(x, faces, edge)
    z = tets.vertices[:, 2]
    return Shape(tets, z < z.min() + _FIXED * np.ptp(z), SolidSettings(young))
