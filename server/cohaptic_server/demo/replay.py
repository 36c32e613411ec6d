"""The force on each hand due to the others, without a network, from recorded tips and forces.

At each instant the recorded forces of all users at that instant are applied to the body, and each
contact is located on the surface displaced by all forces but its own. There is no delay, no lag of
the room and no rate limit. The force on a hand is computed from the body with and without the other
users. The delay of the recorded force is measured against it (`lateness.py`); both contain the same
motion of the hands.
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
_CHANGE = 1.0  # s from the start of a press within which forces without a network change
_SETTLE = 30  # iterations of the contacts at the first instant
_AROUND = 0.02  # m around a contact; radius of the window of displacements


def instants(window: slice) -> Ints:
    """Indices of the grid at which forces are computed, shape (n,)."""
    fine, coarse = round(_FINE / STEP), round(_COARSE / STEP)
    start = window.start + round(AROUND / STEP)
    end = min(window.stop, start + round(_CHANGE / STEP))
    return np.array(
        [
            *range(window.start, start, coarse),
            *range(start, end, fine),
            *range(end, window.stop, coarse),
        ]
    )


@dataclass(frozen=True, eq=False)
class _Hand:
    """One hand at an instant: its contact, and the displacement field in which it was located."""

    contact: Contact
    surface: Field


def felt_at_once(timeline: Timeline, body: Body, window: slice) -> tuple[Floats, Floats]:
    """Force on each hand due to the others, without a network.

    Args:
        timeline: Recordings of the scene.
        body: The touched body.
        window: Indices of the grid around a press.

    Returns:
        Times, shape (n,) [s], and forces, shape (users, n) [N].
    """
    tips, forces = timeline.tips, timeline.forces
    damping = timeline.columns["scale"] * timeline.columns["damping"]
    hands: list[_Hand | None] = [None] * len(tips)
    response: Response | None = None
    at = instants(window)
    felt: list[list[float]] = []
    for k in [*[int(at[0])] * _SETTLE, *at.tolist()]:
        located = [_locate(body, tip, hand) for tip, hand in zip(tips[:, :, k], hands, strict=True)]
        # The passivity layer's damping acts on the hand only, not on the body.
        pressed = [
            max(0.0, float(hand.contact.normal @ force - damped))
            for hand, force, damped in zip(located, forces[:, :, k], damping[:, k], strict=True)
        ]
        loads = [hand.contact.load(f) for hand, f in zip(located, pressed, strict=True)]
        response = body.respond(loads, response)
        free = [FreeField(response, np.array([f]), slice(i, i + 1)) for i, f in enumerate(pressed)]
        own = np.diag(response.compliance)
        felt.append(
            [
                _felt(hand.contact, tip, field, float(c))
                for hand, tip, field, c in zip(located, tips[:, :, k], free, own, strict=True)
            ]
        )
        hands = [_follow(body, hand, field) for hand, field in zip(located, free, strict=True)]
    return timeline.t[at], np.array(felt[_SETTLE:]).T


def _locate(body: Body, tip: Floats, before: _Hand | None) -> _Hand:
    surface = ZeroField() if before is None else before.surface
    hint = None if before is None else before.contact
    return _Hand(locate(body.mesh, tip, surface, radius=body.contact_radius, hint=hint), surface)


def _follow(body: Body, hand: _Hand, free: FreeField) -> _Hand:
    """The field for the next instant, relaxed towards the body's displacement as on the server."""
    near = body.mesh.near(hand.contact.foot, body.contact_radius + _AROUND)
    previous = hand.surface[near]
    return _Hand(
        hand.contact, CachedField(near, previous + RELAXATION * (free.on(near) - previous), free)
    )


def _felt(contact: Contact, tip: Floats, free: Field, compliance: float) -> float:
    """Force of the body on a tip, minus the force if no other user touched [N]."""
    depth = float(contact.normal @ (contact.moved(free) - tip))
    alone = float(contact.normal @ (contact.point - tip))
    return (max(0.0, depth) - max(0.0, alone)) / compliance
