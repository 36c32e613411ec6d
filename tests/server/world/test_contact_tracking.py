"""Where a finger with friction touches; `test_world.py` has the rest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, vec3
from cohaptic_server.world.contact import locate
from cohaptic_server.world.displacement_field import ZeroField
from cohaptic_server.world.state import Touch
from cohaptic_server.world.sticking_equilibrium import StickingHand, compliance_of
from cohaptic_server.world.tick import RELEASE_TIME, advance
from cohaptic_server.world.users import WorldState

DT = 1.0 / 60.0  # s
TICKS = 3 * round(RELEASE_TIME / DT)
RADIUS = 0.1  # m, of the balloon
CLOSE = 2e-4  # m; contacts are found to a few hundredths of a millimetre, tick after tick


def touch(tip: Floats, force: Floats, *, friction: bool) -> Touch:
    return Touch(
        user=1,
        law=Law.PREDICTIVE,
        max_stiffness=1e4,
        max_force=10.0,
        probe=vec3(tip),
        force=vec3(force),
        seq=1,
        tick=0,
        t_client=0.0,
        arrived=0.0,
        friction=friction,
    )


def foot_after(body: Balloon, tip: Floats, force: Floats, *, friction: bool) -> Floats:
    """Of a contact that came to the surface without a force, then got one bit by bit."""
    at, state = np.array([RADIUS, 0.0, 0.0]), WorldState()
    for tick in range(2 * TICKS):
        share = min(1.0, tick / TICKS)
        now = touch(at + share * (tip - at), share * force, friction=friction)
        state, _ = advance(TouchedBody(body), state, [now], now=0.0, dt=DT)
    return state.users[1].contact.foot


@given(st.floats(0.5, 4.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
@settings(max_examples=10, deadline=None)
def test_a_finger_that_sticks_stays_on_its_material(
    small_balloon: Balloon, pressed: float, aside: float, up: float
) -> None:
    """It takes the material along with its own force, as far as the body's 3x3 compliance says."""
    start = np.array([RADIUS, 0.0, 0.0])
    contact = locate(small_balloon.mesh, start, ZeroField(), radius=small_balloon.contact_radius)
    force = np.array([pressed, aside, up])
    C = compliance_of(small_balloon, [StickingHand(vec3(start), 400.0, contact)])[0, :, 0, :]
    tip = contact.point - C @ force
    foot = foot_after(small_balloon, tip, force, friction=True)
    assert foot == pytest.approx(contact.foot, abs=CLOSE)


def test_a_finger_without_friction_slides(small_balloon: Balloon) -> None:
    """The same way of the tip leads it over the surface."""
    tip, force = np.array([0.092, 0.006, 0.0]), np.array([2.0, 0.0, 0.0])
    foot = foot_after(small_balloon, tip, force, friction=False)
    assert foot[1] > 0.005
