"""Places of two hands on the softest part of a body: one thin limb, an ear, a tip, a free end.

Demonstrations keep away from such a place (`demo/places.py`): there a press moves the whole limb,
so that hands slide, turn each other's contacts and feel nearly all of each other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError
from cohaptic.protocol.patch import MIN_COMPLIANCE
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.mesh.surface import spread_over
from cohaptic_server.mesh.thin_parts import depth_under, is_smooth
from cohaptic_tools.demo.lateness import LEAST
from cohaptic_tools.demo.places import (
    is_met_squarely,
    is_open,
    placement_at,
    supported,
    width_of_hand,
)
from cohaptic_tools.demo.scene import Scene, reference
from cohaptic_tools.demo.settled import Placement, rests

_CANDIDATES = 400  # vertices, spread over the surface
_HALVED = 3  # times at the most
_TRIED = 12  # places of the first hand, the softest first; each takes some seconds
_FELT = 1.0  # m/N; on what is softer, 1 N/m, a press of 5 mm is 5 mN, and no hand knows of it
_BESIDE = 6.0  # contact radii from the first hand within which the second one stands


@dataclass(frozen=True, eq=False)
class OnLimb:
    """Two hands on one limb.

    Args:
        placement: Placement of them.
        passed_over: Softer places, a fingertip apart. At no depth that was tried do the hands rest
            there, since a tip without friction slides off and nothing could be said of forces, or
            one of them feels less than `LEAST`, under which no error is told in percent of it.
    """

    placement: Placement
    passed_over: int


def place_on_limb(body: Body, held: npt.NDArray[np.bool_]) -> OnLimb:
    """Two hands: one on the softest place that a finger reaches, feels and holds, one beside it.

    Args:
        body: The body at rest.
        held: Which vertices of its surface are fixed, shape (n,).

    Raises:
        BodyError: There are no two places at which hands rest.
    """
    mesh, radius = body.mesh, body.contact_radius
    candidates = spread_over(mesh.vertices, _CANDIDATES)
    under, soft = depth_under(mesh, candidates), vertex_compliance(body)[candidates]
    fit = is_smooth(mesh)[candidates] & is_open(mesh, candidates, width_of_hand(mesh))
    fit &= supported(mesh, candidates, held, 2.0 * radius) & (under > 0.0) & (soft > MIN_COMPLIANCE)
    fit &= soft <= _FELT
    fit[fit] = is_met_squarely(body, candidates[fit])
    x, normals = mesh.vertices[candidates], mesh.normals[candidates]
    tried: list[int] = []
    fallback: OnLimb | None = None
    strongest = 0.0
    for first in np.flatnonzero(fit)[np.argsort(-soft[fit], kind="stable")].tolist():
        gap = np.linalg.norm(x - x[first], axis=1)
        beside = np.flatnonzero(fit & (gap >= 2.0 * radius) & (gap <= _BESIDE * radius))
        if (gap[tried] < radius).any() or not len(beside):
            continue
        second = int(beside[np.argmin(normals[beside] @ normals[first])])
        chosen = np.array([first, second])
        depth = float(under[chosen].min())
        at_rest = _at_rest(placement_at(body, candidates[chosen], depth), body)
        force = 0.0 if at_rest is None else _least_force(at_rest, body)
        if at_rest is not None and (fallback is None or force > strongest):
            fallback, strongest = OnLimb(at_rest, len(tried)), force
        if fallback is not None and strongest >= LEAST:
            return fallback
        tried.append(first)
        if len(tried) == _TRIED:
            break
    if fallback is None:
        raise BodyError(
            f"{body.name}: there is no place for two hands on its softest part: at {len(tried)} of"
            " them hands do not rest"
        )
    return fallback


def _least_force(placement: Placement, body: Body) -> float:
    """The smaller of the forces on both hands while the first one presses [N]."""
    scene = Scene(2, places=placement.places, depth=placement.depth)
    return float(reference(scene, body, pressed=True).force.min())


def _at_rest(placement: Placement, body: Body) -> Placement | None:
    """The same, less deep where hands do not rest; None where they do at no depth."""
    for _ in range(_HALVED + 1):
        if rests(body, placement):
            return placement
        placement = replace(placement, depth=0.5 * placement.depth)
    return None
