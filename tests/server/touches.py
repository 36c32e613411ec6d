"""Hands at a balloon, for the tests of the world's parts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cohaptic.control.delay import LoopDelay
from cohaptic.control.law import Law
from cohaptic.control.stability.lag_choice import FULL_BUDGET
from cohaptic.vec import Vec3, scale, unit
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import NO_CONTACTS, Contact, Contacts, locate
from cohaptic_server.world.displacement_field import NOWHERE_KNOWN
from cohaptic_server.world.state import Participant, Touch, UserState
from cohaptic_server.world.users import Applied, Tracked, Users, settings_of, vectors

RADIUS = 0.1  # m, of the balloons
NOWHERE = Contact(
    np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    np.zeros(0, dtype=np.int64),
    np.zeros(0),
)


def side(angle: float) -> Vec3:
    return (math.cos(angle), math.sin(angle), 0.0)


def touch(
    user: int = 1,
    *,
    at: Vec3 = (1.0, 0.0, 0.0),
    depth: float = 0.005,
    force: float = 2.0,
    **changes: Any,
) -> Touch:
    """A hand that presses straight towards the middle of the balloon, from the direction `at`.

    Its device may damp so much that two of them on opposite sides need no lag.
    """
    out = unit(at)
    usual = Touch(
        who=Participant(
            user=user,
            law=Law.PREDICTIVE,
            max_stiffness=1e4,
            max_force=10.0,
            damping_budget=FULL_BUDGET,
        ),
        probe=scale(out, RADIUS - depth),
        force=scale(out, force),
        seq=7,
        tick=0,
        t_client=3.25,
        arrived=0.0,
    )
    return changed(usual, **changes)


def changed(one: Touch, **changes: Any) -> Touch:
    """The same touch with other fields, or with other ones of its participant."""
    ours = {name: changes.pop(name) for name in [*changes] if hasattr(one.who, name)}
    return replace(one, who=replace(one.who, **ours), **changes)


def user_of(
    of: Touch, contact: Contact = NOWHERE, *, delay: float | None = None, **changes: Any
) -> UserState:
    """What the world knows of a user who is there in full, and whose loop was measured [s]."""
    measured = LoopDelay() if delay is None else LoopDelay().measured(delay, 0.0)
    return replace(UserState(of, contact, 1.0, 0.0, delay=measured), **changes)


def contact_at(body: Balloon, of: Touch) -> Contact:
    """Where a hand touches the body at rest."""
    still = np.zeros_like(body.mesh.vertices)
    return locate(body.mesh, np.array(of.probe), still, radius=body.contact_radius)


def contacts_of(contacts: Sequence[Contact]) -> Contacts:
    """Contacts as the arrays of a tick."""
    arrays = NO_CONTACTS._replace(
        frames=np.zeros((len(contacts), 3, 3)),
        slopes=np.zeros(len(contacts)),
        starts=np.zeros(len(contacts) + 1, dtype=np.int64),
    )
    for i, contact in enumerate(contacts):
        arrays = arrays.put(i, contact)
    return arrays


def tracked_of(users: Sequence[UserState], before: Iterable[int] = ()) -> Tracked:
    """Users as the arrays of a tick; `before` has the numbers of the users in the tick before."""
    touches, rows = [user.touch for user in users], {k: i for i, k in enumerate(before)}
    return Tracked(
        touches,
        np.array([rows.get(touch.user, -1) for touch in touches], dtype=np.int64),
        vectors([touch.probe for touch in touches]),
        settings_of(touches),
        contacts_of([user.contact for user in users]),
        np.array([user.presence for user in users], dtype=np.float64),
        np.array([user.requested for user in users], dtype=np.float64),
        _tangential([user.requested_tangential for user in users]),
        [i for i, touch in enumerate(touches) if touch.who.friction],
        [user.delay for user in users],
        vectors([user.velocity for user in users]),
        np.array([user.requested for user in users], dtype=np.float64),
        NOWHERE_KNOWN,
    )


def applied_of(users: Sequence[UserState]) -> Applied:
    """The forces that the body carries, as the arrays of a tick."""
    return Applied(
        np.array([user.presence for user in users], dtype=np.float64),
        np.array([user.force for user in users], dtype=np.float64),
        _tangential([user.tangential for user in users]),
    )


def users_of(users: Sequence[UserState]) -> Users:
    """Users as a tick leaves them behind, but for their surfaces."""
    return Users(tracked_of(users), applied_of(users))


def _tangential(forces: Sequence[Floats | None]) -> Floats:
    return vectors([(0.0, 0.0, 0.0) if force is None else force.tolist() for force in forces])
