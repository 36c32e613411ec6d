"""The stiffened tangent of hyperelastic tetrahedra: it leaves out what can make it indefinite."""

from __future__ import annotations

import numpy as np

from cohaptic_server.bodies.rubber_solid.neo_hookean import NeoHookean
from cohaptic_server.numeric import Floats


def removed(material: NeoHookean, swell: Floats, weighted: Floats, J: Floats) -> Floats:
    """What a fully stiffened tangent has beside the exact one, shape (k, 3 a, 3 a) [N/m].

    With h the gradients of the shape functions in the present state it is
    1/2 (|s| (h_a . h_b) d_ij - s h_aj h_bi) at each point.

    Args:
        material: mu and lambda of these elements, shape (k,) [Pa].
        swell: From `element_loops.moduli`, J h, shape (k, q, 3 a).
        weighted: From there, w U'' J h, shape (k, 3 a, q).
        J: Shape (k, q).
    """
    mu, lame = material.mu[:, None], material.lame[:, None]
    s = mu - 0.5 * lame * (J - 1.0) * (J + 1.0)
    share = 0.5 * s / (mu + 0.5 * lame * (1.0 + J * J))  # over U'' J^2
    k, _, width = swell.shape
    shape = (k, width // 3, 3, width // 3, 3)
    crossed = ((weighted * share[:, None]) @ swell).reshape(shape).transpose(0, 1, 4, 3, 2)
    between = np.einsum("kaibi->kab", ((weighted * np.abs(share)[:, None]) @ swell).reshape(shape))
    removed = -crossed
    for axis in range(3):
        removed[:, :, axis, :, axis] += between
    return np.asarray(removed.reshape(k, width, width))
