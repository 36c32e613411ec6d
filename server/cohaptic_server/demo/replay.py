"""What everybody would have felt of the others without a network.

At each instant the body gets everybody's recorded force, all of it and of that very instant, and
each contact is found on the surface that this leaves free of its own force. Nobody waits: there is
no delay, no lag of a room, no limit of a rate. The force that a hand would have is the body's own,
with and without the others. How late a hand felt them is then read off the two forces
(`lateness.py`); what the hands did meanwhile is in both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic_server.bodies.body import Body, Response
from cohaptic_server.demo.analysis import AROUND, STEP, Timeline
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.contact import Contact, locate
from cohaptic_server.world.contact_tracking import RELAXATION
from cohaptic_server.world.displacement_field import CachedField, Field, FreeField, ZeroField

_FINE, _COARSE = 0.01, 0.05  # s between instants, while forces change and while they rest
_CHANGE = 1.0  # s after a press began in which the forces at once have changed
_SETTLE = 30  # times that contacts are found anew at the first instant
_AROUND = 0.02  # m round a contact in which the surface is followed


def instants(window: slice) -> Ints:
    """Indices of the grid at which a window is looked at, shape (n,)."""
    fine, coarse = round(_FINE / STEP), round(_COARSE / STEP)
    begins = window.start + round(AROUND / STEP)
    over = min(window.stop, begins + round(_CHANGE / STEP))
    return np.array(
        [
            *range(window.start, begins, coarse),
            *range(begins, over, fine),
            *range(over, window.stop, coarse),
        ]
    )


@dataclass(frozen=True, eq=False)
class _Hand:
    """One hand at an instant, and the surface that its contact was found on."""

    contact: Contact
    surface: Field


def felt_at_once(timeline: Timeline, body: Body, window: slice) -> tuple[Floats, Floats]:
    """Force that each hand would have of the others, if nothing took time.

    Args:
        timeline: Of the scene.
        body: What was touched.
        window: Of the grid, round a press.

    Returns:
        Times, shape (n,) [s], and forces, shape (users, n) [N].
    """
    tips, forces = timeline.tips, timeline.forces
    damping = timeline.columns["scale"] * timeline.columns["damping"]
    hands: list[_Hand | None] = [None] * len(tips)
    response: Response | None = None
    at = instants(window)
    found: list[list[float]] = []
    for k in [*[int(at[0])] * _SETTLE, *at.tolist()]:
        placed = [_place(body, tip, hand) for tip, hand in zip(tips[:, :, k], hands, strict=True)]
        # The damping of the passivity layer is the hand's affair, not the body's.
        pressed = [
            max(0.0, float(hand.contact.normal @ force - damped))
            for hand, force, damped in zip(placed, forces[:, :, k], damping[:, k], strict=True)
        ]
        loads = [hand.contact.load(f) for hand, f in zip(placed, pressed, strict=True)]
        response = body.respond(loads, response)
        free = [FreeField(response, np.array([f]), slice(i, i + 1)) for i, f in enumerate(pressed)]
        own = np.diag(response.compliance)
        found.append(
            [
                _felt(hand.contact, tip, field, float(c))
                for hand, tip, field, c in zip(placed, tips[:, :, k], free, own, strict=True)
            ]
        )
        hands = [_follow(body, hand, field) for hand, field in zip(placed, free, strict=True)]
    return timeline.t[at], np.array(found[_SETTLE:]).T


def _place(body: Body, tip: Floats, before: _Hand | None) -> _Hand:
    surface = ZeroField() if before is None else before.surface
    hint = None if before is None else before.contact
    return _Hand(locate(body.mesh, tip, surface, radius=body.contact_radius, hint=hint), surface)


def _follow(body: Body, hand: _Hand, free: FreeField) -> _Hand:
    """The surface for the next instant, a part of the way after the body, as on the server."""
    near = body.mesh.near(hand.contact.foot, body.contact_radius + _AROUND)
    was = hand.surface[near]
    return _Hand(hand.contact, CachedField(near, was + RELAXATION * (free.on(near) - was), free))


def _felt(contact: Contact, tip: Floats, free: Field, compliance: float) -> float:
    """Force of the body on a tip, less what it would be if nobody else touched [N]."""
    depth = float(contact.normal @ (contact.moved(free) - tip))
    alone = float(contact.normal @ (contact.point - tip))
    return (max(0.0, depth) - max(0.0, alone)) / compliance
