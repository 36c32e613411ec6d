"""Hands at a balloon, for the tests of the world's parts."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from cohaptic.control.delay import LoopDelay
from cohaptic.control.law import Law
from cohaptic.control.stability.lag_choice import FULL_BUDGET
from cohaptic.vec import Vec3, scale, unit
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.world.contact import Contact, locate
from cohaptic_server.world.state import Touch, UserState

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
        user=user,
        law=Law.PREDICTIVE,
        max_stiffness=1e4,
        max_force=10.0,
        probe=scale(out, RADIUS - depth),
        force=scale(out, force),
        seq=7,
        tick=0,
        t_client=3.25,
        arrived=0.0,
        damping_budget=FULL_BUDGET,
    )
    return replace(usual, **changes)


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
