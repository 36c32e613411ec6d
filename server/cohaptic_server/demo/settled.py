"""Hands that press come to rest, or stand elsewhere, or press less deep.

A finger without friction slides off where the surface under it turns away: beside the dent of
another, at an edge, and sooner on rubber, whose surface turns more than a linear one's. Where body
and hands have no equilibrium near the places, nothing could be said of the forces there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cohaptic.errors import BodyError
from cohaptic.simulated.hand import Place
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.demo.scene import Scene, reference
from cohaptic_server.world.equilibrium import Equilibrium

# Contact radii along the surface from its place at which a hand has slid off: 12 mm of a finger.
_SLID = 1.5
# Of `solve`; where hands rest it takes 20 to 40, and those that creep longer swing in a session.
_PATIENCE = 60
# Times the compliance at rest from which a place gives way. On rubber with a few elements under a
# hand some sessions with 2.1 times, and all with 3.7 and more, wandered about and never came to
# rest (five meshes, 5 to 20 mm deep, 0 and 250 ms each way); up to 1.7 all rested.
_GIVES_WAY = 1.5
# `Equilibrium.turning` up to which hands hold their tips: from 1 on they slide off, or the limb
# between them moves away sideways, and near it they take long to rest.
_HOLDS = 0.5
_TRIED = 3  # placements at each depth; where none of them rests, few others do
_DEPTHS = (1.0, 0.7, 0.5, 0.35, 0.25)  # shares of the intended depth


@dataclass(frozen=True, eq=False)
class Placement:
    """Places of hands on a body.

    Args:
        places: Place of each hand; the first one presses.
        depth: Intended depth of the first hand's press [m].
        coupling: C_1j / C_jj of each hand with the first, shape (users,): displacement under hand
            j by a force of the first, relative to that by its own; 1 for the first.
        distances: Distance of each hand from the first, shape (users,) [m].
    """

    places: tuple[Place, ...]
    depth: float
    coupling: tuple[float, ...]
    distances: tuple[float, ...]


def first_that_rests(
    body: Body, placements: Sequence[Placement], progress: Callable[[float], None]
) -> Placement:
    """The first of several placements, at the largest depth, at which the hands come to rest.

    Args:
        body: The body at rest.
        placements: The best first; at least one.
        progress: Receives the completed share.

    Returns:
        The first one at its smallest depth if the hands rest at none: a demonstration says so.
    """
    tried = list(_tried(placements[:_TRIED]))
    for k, placement in enumerate(tried):
        progress(k / len(tried))
        if rests(body, placement):
            return placement
    return replace(placements[0], depth=_DEPTHS[-1] * placements[0].depth)


def _tried(placements: Sequence[Placement]) -> Iterator[Placement]:
    for share in _DEPTHS:
        for placement in placements:
            yield replace(placement, depth=share * placement.depth)


def rests(body: Body, placement: Placement) -> bool:
    """Whether hands rest there, pressed and off: none slides off its place, no place gives way.

    Args:
        body: The body at rest.
        placement: Places and depth of the hands.
    """
    scene = Scene(len(placement.places), places=placement.places, depth=placement.depth)
    point = np.array([place.point for place in placement.places])
    inward = np.array([place.inward for place in placement.places])
    mesh = body.mesh
    vertices = np.linalg.norm(mesh.vertices[None] - point[:, None], axis=2).argmin(axis=1)
    soft = _GIVES_WAY * vertex_compliance(body)[vertices]
    for pressed in (False, True):
        try:
            found = reference(scene, body, pressed=pressed, iterations=_PATIENCE)
        except BodyError:
            return False
        off = found.tip - point
        along = off - np.einsum("ui,ui->u", off, inward)[:, None] * inward
        touching = found.force > 0.0
        # One that has come through to the far side touches no more; another may be pushed off.
        if not (touching[0] if pressed else touching[1:].all()):
            return False
        if not held_fast(found):
            return False
        slid = np.linalg.norm(along, axis=1) > _SLID * body.contact_radius
        if (touching & (slid | (np.diag(found.compliance) > soft))).any():
            return False
    return True


def held_fast(found: Equilibrium) -> bool:
    """Whether hands can hold their tips where they found an equilibrium (science 3.12)."""
    return found.turning <= _HOLDS
