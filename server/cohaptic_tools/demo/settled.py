"""Chooses a placement and a depth of the hands for which pressing hands come to rest.

A finger without friction slides off if the surface under the finger tilts: beside the dent of
another finger, or at an edge, and sooner on rubber, whose surface tilts more than the surface of a
linear body. If body and hands have no equilibrium near the places, there are no reference forces.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cohaptic.errors import BodyError
from cohaptic.simulated.hand import Place
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.world.equilibrium import Equilibrium
from cohaptic_tools.demo.felt import MAX_PRESS, RENDERED, PairForces
from cohaptic_tools.demo.scene import Scene, reference

# Distance in contact radii, 12 mm for a finger: a hand further away from its place has slid off,
# and a surface that the other hands displace further has moved away. On a knot's loop of 1 N/m two
# hands that pressed 3 mm deep also had an equilibrium of 0.25 N, 80 mm away from their places.
_SLID = 1.5
# Largest number of iterations of `solve`. If hands rest, `solve` needs 35 to 60 iterations, half of
# them for its check; hands that creep for longer oscillate in a session.
_PATIENCE = 80
# A place gives way if its compliance exceeds this multiple of the compliance at rest. On rubber
# with a few elements under a hand, some sessions with 2.1 times, and all with 3.7 times and more,
# never came to rest (five meshes, 5 to 20 mm deep, 0 and 250 ms each way); up to 1.7 times all did.
_GIVES_WAY = 1.5
# Largest `Equilibrium.turning` at which hands hold their tips. From 1 on the hands slide off, or
# the limb between them moves away sideways; just below 1 the hands take long to come to rest.
_HOLDS = 0.5
_TRIED = 6  # placements at each depth
_DEPTHS = (1.0, 0.7, 0.5, 0.35, 0.25, 0.12)  # fractions of the intended depth


@dataclass(frozen=True, eq=False)
class Placement:
    """Places of hands on a body.

    Args:
        places: Place of each hand; the first one presses.
        depth: Intended depth of the first hand's press [m].
        coupling: Compliance ratio C_1j / C_jj of each hand j with the first hand, shape (users,):
            displacement under hand j by a force of the first hand, over the displacement by the
            same force of hand j; 1 for the first hand.
        distances: Distance of each hand from the first, shape (users,) [m].
        pair: Forces of the first two hands with the first one pressed: predicted, or at rest; zero
            if the hands do not rest.
    """

    places: tuple[Place, ...]
    depth: float
    coupling: tuple[float, ...]
    distances: tuple[float, ...]
    pair: PairForces


def first_that_rests(
    body: Body, placements: Sequence[Placement], progress: Callable[[float], None]
) -> Placement:
    """Return the first placement, at the largest possible depth, at which hands feel each other.

    Args:
        body: The body at rest.
        placements: Placements, the best first; at least one.
        progress: Called with the completed fraction, 0 to 1.

    Returns:
        Of the largest depth at which some placement rests and is felt (`PairForces.is_felt`), the
        first such placement. If there is none at any depth, the placement whose forces come closest
        to being felt. If the hands rest
        nowhere, the first placement at its smallest depth; the demonstration then shows that.
    """
    remaining = list(placements[:_TRIED])
    tried = len(remaining) * len(_DEPTHS)
    best: Placement | None = None
    for k, fraction in enumerate(_DEPTHS):
        for j, placement in enumerate(tuple(remaining)):
            progress(k / len(_DEPTHS) + j / tried)
            found = at_rest(body, replace(placement, depth=fraction * placement.depth))
            if found is None:
                continue
            if found.pair.is_felt:
                return found
            if best is None or found.pair.enough > best.pair.enough:
                best = found
            if found.pair.force.max() <= MAX_PRESS:
                remaining.remove(placement)  # a press that is less deep is felt less
    if best is not None:
        return best
    unknown = PairForces(np.zeros(2), np.zeros(2))
    return replace(placements[0], depth=_DEPTHS[-1] * placements[0].depth, pair=unknown)


def rests(body: Body, placement: Placement) -> bool:
    """Whether the hands come to rest at a placement, judged by `at_rest`."""
    return at_rest(body, placement) is not None


def at_rest(body: Body, placement: Placement) -> Placement | None:
    """Return a placement with the forces at which its hands rest; None if they do not rest.

    The hands rest if, with the first hand pressed and off, no hand slides off its place and no
    place gives way or hardens.

    Args:
        body: The body at rest.
        placement: Places and depth of the hands.
    """
    scene = Scene(len(placement.places), places=placement.places, depth=placement.depth)
    point = np.array([place.point for place in placement.places])
    inward = np.array([place.inward for place in placement.places])
    mesh = body.mesh
    vertices = np.linalg.norm(mesh.vertices[None] - point[:, None], axis=2).argmin(axis=1)
    table = vertex_compliance(body, vertices)
    soft = _GIVES_WAY * table
    # On a cow of 6 MPa a contact moved 3 mm along a flank, from 1400 N/m to 2200 N/m. No device
    # renders that, and forces were 1.7 % off.
    hard = np.where(table >= 1.0 / RENDERED, 1.0 / RENDERED, 0.0)
    for pressed in (False, True):
        try:
            found = reference(scene, body, pressed=pressed, iterations=_PATIENCE)
        # A solid that is pressed far too deep has no finite compliance, and no eigenvalues.
        except (BodyError, np.linalg.LinAlgError):
            return None
        off = found.tip - point
        along = off - np.einsum("ui,ui->u", off, inward)[:, None] * inward
        touching = found.force > 0.0
        # A hand that has passed through the body no longer touches it; while the first hand
        # presses, it may push the others off.
        if not (touching[0] if pressed else touching[1:].all()):
            return None
        if not held_fast(found):
            return None
        own = np.diag(found.compliance)
        by_others = np.abs(found.compliance @ found.force - own * found.force)
        farthest = _SLID * body.contact_radius
        # A tip deep in a thin rod hardly moves while its contact moves round the rod.
        gone = np.linalg.norm(found.place - point, axis=1)
        slid = (np.linalg.norm(along, axis=1) > farthest) | (gone > farthest)
        slid |= by_others > farthest
        if (touching & (slid | (own > soft) | (own < hard))).any():
            return None
        pair = PairForces(found.force[:2], np.abs(found.felt_from_others[:2]))
    return replace(placement, pair=pair)


def held_fast(found: Equilibrium) -> bool:
    """Whether the hands hold their tips in an equilibrium without sliding off (science 3.12)."""
    return found.turning <= _HOLDS
