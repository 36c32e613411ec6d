"""Places of two hands on the softest part of a body: one thin limb, an ear, a tip, a free end.

Demonstrations keep away from such a place (`demo/places.py`): there a press moves the whole limb,
so that hands slide, turn each other's contacts and feel nearly all of each other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic.protocol.patch import MIN_COMPLIANCE
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.demo.places import is_open, placement_at, supported, width_of_hand
from cohaptic_server.demo.scene import Scene, reference
from cohaptic_server.demo.settled import Placement, held_fast
from cohaptic_server.mesh.sampling import spread_over
from cohaptic_server.mesh.thickness import depth_under, is_smooth
from cohaptic_server.world.rims import is_met_squarely

_CANDIDATES = 400  # vertices, spread over the surface
_HALVED = 3  # times at the most
# m/N; on what is softer, 1 N/m, a press of 5 mm is 5 mN, and no hand knows of it
_FELT = 1.0
_BESIDE = 6.0  # contact radii from the first hand within which the second one stands


def place_on_limb(body: Body, held: npt.NDArray[np.bool_]) -> Placement:
    """Two hands: one on the softest place that a finger reaches and feels, one beside it.

    Args:
        body: The body at rest.
        held: Which vertices of its surface are fixed, shape (n,).

    Raises:
        BodyError: No two places can be reached.
    """
    mesh, radius = body.mesh, body.contact_radius
    candidates = spread_over(mesh.vertices, _CANDIDATES)
    under, soft = depth_under(mesh, candidates), vertex_compliance(body)[candidates]
    fit = is_smooth(mesh)[candidates] & is_open(mesh, candidates, width_of_hand(mesh))
    fit &= supported(mesh, candidates, held, 2.0 * radius) & (under > 0.0) & (soft > MIN_COMPLIANCE)
    fit &= soft <= _FELT
    fit[fit] = is_met_squarely(body, candidates[fit])
    x, normals = mesh.vertices[candidates], mesh.normals[candidates]
    for first in np.flatnonzero(fit)[np.argsort(-soft[fit], kind="stable")].tolist():
        gap = np.linalg.norm(x - x[first], axis=1)
        beside = np.flatnonzero(fit & (gap >= 2.0 * radius) & (gap <= _BESIDE * radius))
        if len(beside):
            second = int(beside[np.argmin(normals[beside] @ normals[first])])
            chosen = np.array([first, second])
            return _with_equilibrium(
                placement_at(body, candidates[chosen], float(under[chosen].min())), body
            )
    raise BodyError(f"{body.name}: there is no place for two hands on its softest part")


def _with_equilibrium(placement: Placement, body: Body) -> Placement:
    """The same, less deep where hands would slide off, or for ever, so that nothing is known."""
    for _ in range(_HALVED):
        scene = Scene(2, places=placement.places, depth=placement.depth)
        try:
            if held_fast(reference(scene, body, pressed=True)):
                break
        except BodyError:
            pass  # nothing is known of it either
        placement = replace(placement, depth=0.5 * placement.depth)
    return placement
