"""Where a finger with friction touches; `test_world.py` has the rest."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic.vec import Vec3
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, vec3
from cohaptic_server.world.applied_forces import RELEASE_TIME
from cohaptic_server.world.contact import locate
from cohaptic_server.world.displacement_field import ZeroField
from cohaptic_server.world.state import Participant, Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState
from tests.examples_of_laws import examples
from tests.strategies import vectors

DT = 1.0 / 60.0  # s
TICKS = 3 * round(RELEASE_TIME / DT)
RADIUS = 0.1  # m, of the balloon
CLOSE = 2e-4  # m; contacts are found to a few hundredths of a millimetre, tick after tick


def touch(
    tip: Floats,
    force: Floats,
    *,
    user: int = 1,
    friction: bool = False,
    anchor: Floats | None = None,
) -> Touch:
    return Touch(
        who=Participant(
            user=user, law=Law.PREDICTIVE, max_stiffness=1e4, max_force=10.0, friction=friction
        ),
        probe=vec3(tip),
        force=vec3(force),
        seq=1,
        tick=0,
        t_client=0.0,
        arrived=0.0,
        anchor=None if anchor is None else vec3(anchor),
    )


def foot_after(
    body: Balloon, tip: Floats, force: Floats, anchor: Floats | None, others: Sequence[Touch] = ()
) -> Floats:
    """Of a contact that came to the surface without a force, then got one bit by bit."""
    at, state = np.array([RADIUS, 0.0, 0.0]), WorldState()
    for tick in range(2 * TICKS):
        fraction = min(1.0, tick / TICKS)
        now = touch(
            at + fraction * (tip - at), fraction * force, friction=anchor is not None, anchor=anchor
        )
        state, _ = advance(
            TouchedBody(body), state, [now, *others], now=(state.tick + 1) * DT, dt=DT
        )
    return state.users[1].contact.foot


@given(st.floats(0.5, 4.0), vectors(0.01), st.floats(-1.2, 1.2), st.floats(0.0, 3.0))
@settings(max_examples=examples(10), deadline=None)
def test_a_finger_stays_on_the_point_that_it_holds(
    small_balloon: Balloon, pressed: float, way: Vec3, beside: float, other: float
) -> None:
    """Wherever its tip is, whatever its force, and however another moves the surface."""
    start = np.array([RADIUS, 0.0, 0.0])
    contact = locate(small_balloon.mesh, start, ZeroField(), radius=small_balloon.contact_radius)
    out = np.array([math.cos(beside), math.sin(beside), 0.0])
    neighbour = touch(0.97 * RADIUS * out, other * out, user=2)
    tip, force = contact.point + np.array(way), np.array([pressed, 0.2 * pressed, 0.0])
    foot = foot_after(small_balloon, tip, force, contact.point, [neighbour])
    assert foot == pytest.approx(contact.foot, abs=CLOSE)


def test_a_finger_that_holds_nothing_slides(small_balloon: Balloon) -> None:
    """The same way of the tip leads it over the surface."""
    foot = foot_after(small_balloon, np.array([0.092, 0.006, 0.0]), np.array([2.0, 0.0, 0.0]), None)
    assert foot[1] > 0.005
