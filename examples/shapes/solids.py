"""Sound closed surfaces: plain bodies, turned and swept ones, a machine part, scans."""

from __future__ import annotations

import numpy as np

from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.numeric import Floats, cross
from shapes.grids import Mesh, periodic, square, standing, star, thickened, turned

SCAN_AROUND, SCAN_ACROSS = 200, 151  # 60,000 triangles
_NOISE = 3e-4  # m; of a hand-held scanner, root mean square


def torus(ring: float = 0.06, tube: float = 0.025, around: int = 56, across: int = 28) -> Mesh:
    """A torus that lies on z = 0.

    Args:
        ring: Radius of the middle of the tube [m].
        tube: Radius of the tube [m].
        around: Vertices round the ring.
        across: Vertices round the tube.
    """
    u = 2.0 * np.pi * np.arange(around) / around
    v = 2.0 * np.pi * np.arange(across) / across
    out = ring + tube * np.cos(v)
    x = np.stack(
        [
            np.outer(np.cos(u), out),
            np.outer(np.sin(u), out),
            np.broadcast_to(tube * (1.0 + np.sin(v)), (around, across)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    return x, periodic(around, across)


def ball(radius: float = 0.05, subdivisions: int = 3) -> Mesh:
    """A ball that stands on z = 0.

    Args:
        radius: Radius of the ball [m].
        subdivisions: Subdivisions of an icosahedron.
    """
    return standing(icosphere(subdivisions, radius))


def noisy_ball() -> Mesh:
    """A ball whose vertices lie up to 4 % further in or out, like a pebble."""
    x, faces = icosphere(4, 0.05)
    return standing((x * np.random.default_rng(0).uniform(0.96, 1.04, (len(x), 1)), faces))


def plate(thickness: float = 0.003, size: float = 0.12, cells: int = 24) -> Mesh:
    """A square plate.

    Args:
        thickness: Thickness of the plate [m].
        size: Length of a side [m].
        cells: Along each side.
    """
    return standing(thickened(square(cells, size), thickness))


def cube(size: float = 0.08) -> Mesh:
    """A cube of twelve triangles, with sharp edges."""
    return plate(size, size, 1)


def rod() -> Mesh:
    """A rod 0.3 m long and 20 mm thick, with flat ends, that stands up."""
    side = [(0.01, 0.3 * k / 40) for k in range(41)]
    return turned(np.array([(0.0, 0.0), (0.005, 0.0), *side, (0.005, 0.3), (0.0, 0.3)]), 24)


def cone(radius: float = 0.05, height: float = 0.12, around: int = 48) -> Mesh:
    """A cone with a sharp tip.

    Args:
        radius: Radius of its foot [m].
        height: Height of its tip [m].
        around: Vertices round its foot.
    """
    foot = [(radius * k / 6, 0.0) for k in range(7)]
    side = [(radius * (1 - k / 16), height * k / 16) for k in range(1, 16)]
    return turned(np.array([*foot, *side, (0.0, height)]), around)


def bottle(wall: float = 0.002) -> Mesh:
    """An open bottle 0.2 m tall.

    Args:
        wall: Thickness of its wall and foot [m].
    """
    outside = [
        (0.02, 0.0),
        (0.035, 0.0),
        (0.035, 0.03),
        (0.035, 0.06),
        (0.035, 0.09),
        (0.035, 0.12),
    ]
    outside += [(0.03, 0.135), (0.018, 0.15), (0.014, 0.165), (0.014, 0.2)]
    inside = [(r - wall, max(z, wall) if z < 0.2 else z) for r, z in reversed(outside)]
    return turned(np.array([(0.0, 0.0), *outside, *inside, (0.0, wall)]), 48)


def gear(teeth: int = 16, thickness: float = 0.02) -> Mesh:
    """A gear of 0.12 m with a bore: teeth of four corners each, sharp edges.

    Args:
        teeth: Number of teeth.
        thickness: Along its axis [m].
    """
    n = 4 * teeth
    angle = 2.0 * np.pi * (np.arange(n) + 0.3 * np.tile([1.0, 0.0, 1.0, 0.0], teeth)) / n
    tip = np.tile([0.05, 0.06, 0.06, 0.05], teeth)
    bore = np.full(n, 0.02)
    # Columns from the bore's foot out, up, and back in: a torus with sharp edges.
    rings = [(bore, 0.0), (tip, 0.0), (tip, thickness), (bore, thickness)]
    x = np.stack(
        [np.stack([r * np.cos(angle), r * np.sin(angle), np.full(n, z)], axis=1) for r, z in rings],
        axis=1,
    )
    return x.reshape(-1, 3), periodic(n, 4)


def knot(around: int = 240, across: int = 14, tube: float = 0.011) -> Mesh:
    """A tube along a trefoil.

    Args:
        around: Vertices along the trefoil.
        across: Vertices round the tube.
        tube: Radius of the tube [m].
    """
    t = 2.0 * np.pi * np.arange(around) / around

    def middle(t: Floats) -> Floats:
        out = 2.0 + np.cos(3.0 * t)
        return 0.03 * np.stack([out * np.cos(2.0 * t), out * np.sin(2.0 * t), np.sin(3.0 * t)], 1)

    ahead = middle(t + 1e-4) - middle(t - 1e-4)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    # Outwards of the torus that the trefoil winds on: a frame that closes on itself.
    core = 0.06 * np.stack([np.cos(2.0 * t), np.sin(2.0 * t), np.zeros_like(t)], axis=1)
    out = middle(t) - core
    out -= (out * ahead).sum(axis=1, keepdims=True) * ahead
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    up = cross(out, ahead)
    v = 2.0 * np.pi * np.arange(across) / across
    round_ = np.cos(v)[:, None] * out[:, None] + np.sin(v)[:, None] * up[:, None]
    return standing(((middle(t)[:, None] + tube * round_).reshape(-1, 3), periodic(around, across)))


def scan() -> Mesh:
    """A head-sized lump as a scanner sees it: 60,000 triangles, noise in each vertex."""
    noise = np.random.default_rng(1)

    def radius(d: Floats) -> Floats:
        x, y, z = d.T
        lump = 0.09 + 0.02 * z + 0.012 * np.exp(-12.0 * ((x - 0.9) ** 2 + y**2 + z**2))
        lump += 0.006 * np.sin(5.0 * x) * np.cos(4.0 * y) + 0.003 * np.sin(11.0 * z + 6.0 * y)
        return np.asarray(lump + noise.normal(0.0, _NOISE, len(d)))

    return standing(star(radius, SCAN_AROUND, SCAN_ACROSS))
