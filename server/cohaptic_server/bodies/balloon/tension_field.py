"""Neo-Hookean rubber that wrinkles: the relaxed energy of a membrane that carries no compression.

A thin sheet pressed together buckles into wrinkles finer than any triangle, at almost no force.
Without them the energy of `membrane.py` would resist compression, its tangent would be indefinite
there, and a mesh would crumple. The relaxed energy (Pipkin 1986, IMA J. Appl.
Math. 36; Steigmann 1990) takes the wrinkles of least energy, per area of the unstretched sheet and
with the principal stretches squared c1 >= c2:

    taut      c2^2 c1 > 1     W = mu h / 2 (c1 + c2 + 1 / (c1 c2) - 3)      as in `membrane.py`
    wrinkled  else, c1 > 1    W = mu h / 2 (c1 + 2 / sqrt(c1) - 3)          the width follows freely
    slack     else            W = 0

It is convex in the deformation gradient: its Hessian, which is exact here, has no negative mode in
any state, and the only source of an indefinite tangent is the pressure of the water. The Hessian
jumps where a triangle begins to wrinkle; energy and force do not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic_server.numeric import Floats

# Pairs of (p, a), (q, b) kept of the symmetric 6x6 tensor of each triangle.
ENTRIES = [
    (p, a, q, b)
    for p, q in ((0, 0), (1, 1), (0, 1))
    for a in range(3)
    for b in range(3)
    if p != q or a <= b
]


@dataclass(frozen=True, eq=False)
class MembraneStrain:
    """Principal strains of triangles.

    Args:
        axes: Cosine and sine of the first principal axis in the unstretched sheet, shape (2, m).
        columns: Deformation gradient along both principal axes, shape (2, 3, m).
        c: Squares of the principal stretches, larger first, shape (2, m).
        taut: Whether both directions are in tension, shape (m,).
        pulled: Whether the first one is in tension, shape (m,).
    """

    axes: Floats
    columns: Floats
    c: Floats
    taut: npt.NDArray[np.bool_]
    pulled: npt.NDArray[np.bool_]


def membrane_strain(F: Floats) -> MembraneStrain:
    """Principal strains of the deformation gradients `F`, shape (2, 3, m): [column, axis, face]."""
    one, two = F
    c11, c22 = (one * one).sum(axis=0), (two * two).sum(axis=0)
    c12 = (one * two).sum(axis=0)
    # Half angles without a branch; where both stretches are equal any axes are principal.
    mean, half = 0.5 * (c11 + c22), 0.5 * (c11 - c22)
    radius = np.hypot(half, c12)
    angle = 0.5 * np.arctan2(c12, half)
    cos, sin = np.cos(angle), np.sin(angle)
    columns = np.stack([cos * one + sin * two, cos * two - sin * one])
    c1 = np.maximum(mean + radius, 1e-30)
    # From the product, not the difference: exact also for a triangle that is nearly a line.
    c2 = np.maximum(c11 * c22 - c12 * c12, 0.0) / c1
    pulled = c1 > 1.0
    taut = c1 * c2 * c2 > 1.0
    return MembraneStrain(np.stack([cos, sin]), columns, np.stack([c1, c2]), taut, pulled | taut)


def energy_density(state: MembraneStrain) -> Floats:
    """W / (mu h), shape (m,)."""
    c1, c2 = state.c
    # Wrinkles: c2 of uniaxial tension.
    width = np.array(c1**-0.5)
    width[state.taut] = c2[state.taut]
    return np.where(state.pulled, 0.5 * (c1 + width + 1.0 / (c1 * width) - 3.0), 0.0)


def stress(state: MembraneStrain) -> Floats:
    """First Piola-Kirchhoff stress over mu, dW/dF / (mu h), shape (2, 3, m)."""
    s = _principal_stress(state)
    cos, sin = state.axes
    first, second = s[0] * state.columns[0], s[1] * state.columns[1]
    return np.stack([cos * first - sin * second, sin * first + cos * second])


def moduli(state: MembraneStrain) -> Floats:
    """d2W/dF2 / (mu h) at `ENTRIES`, shape (21, m)."""
    c1, c2 = state.c
    s1, s2 = _principal_stress(state)
    taut, pulled = state.taut, state.pulled
    det = np.where(taut, c1 * c2, 1.0)
    over = np.where(taut, 1.0 / (det * det), 0.0)
    # Stress per strain, along, across and in shear (4 W_11, 4 W_22, 4 W_12, (S1 - S2)/(c1 - c2)).
    wrinkled = pulled & ~taut
    gap = np.where(wrinkled, c1 - c2, 1.0)
    k11 = np.where(taut, 4.0 * over * c2 / c1, np.where(pulled, 3.0 * c1**-2.5, 0.0))
    k22 = np.where(taut, 4.0 * over * c1 / np.where(taut, c2, 1.0), 0.0)
    k12 = 2.0 * over
    shear = np.where(taut, over, np.where(wrinkled, s1 / gap, 0.0))
    (f, g), (cos, sin) = state.columns, state.axes
    out = np.empty((len(ENTRIES), c1.size))
    cc, ss, cs = cos * cos, sin * sin, cos * sin
    for e, (p, a, q, b) in enumerate(ENTRIES):
        # In principal axes: along-along, across-across, along-across and its transpose.
        ff, gg, fg, gf = f[a] * f[b], g[a] * g[b], f[a] * g[b], g[a] * f[b]
        one = k11 * ff + shear * gg
        two = k22 * gg + shear * ff
        if a == b:
            one = one + s1
            two = two + s2
        mixed, turned = k12 * fg + shear * gf, k12 * gf + shear * fg
        if p == q == 0:
            out[e] = cc * one + ss * two - cs * (mixed + turned)
        elif p == q == 1:
            out[e] = ss * one + cc * two + cs * (mixed + turned)
        else:
            out[e] = cs * (one - two) + cc * mixed - ss * turned
    return out


def _principal_stress(state: MembraneStrain) -> Floats:
    """Second Piola-Kirchhoff stress over mu along the principal axes, shape (2, m)."""
    c1, c2 = state.c
    product = np.where(state.taut, c1 * c2, 1.0)
    s1 = np.where(
        state.taut,
        1.0 - 1.0 / (c1 * product),
        np.where(state.pulled, 1.0 - c1**-1.5, 0.0),
    )
    s2 = np.where(state.taut, 1.0 - 1.0 / (np.where(state.taut, c2, 1.0) * product), 0.0)
    return np.stack([s1, s2])
