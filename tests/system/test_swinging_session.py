"""Hands on an object that swings, in virtual time (science 3.14)."""

from __future__ import annotations

import numpy as np
import pytest

from cohaptic.control.law import Law
from cohaptic.simulated.hand import HandScript, Place
from cohaptic_experiments.virtual_session import VirtualSession, VirtualUser
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.modal.modal_body import ModalResponse
from cohaptic_server.numeric import vec3
from cohaptic_server.world.lags import felt_swing
from tests.server.bodies.modal.jelly import jelly, solid

SETTLE = 6.0  # s; with a damping of 0.2 the slowest mode falls to 1e-2 of a swing in 2.5 to 5


def place(x: float, y: float, z: float) -> Place:
    """The vertex of the jelly next to a point."""
    vertices = solid().mesh.vertices
    k = int(np.argmin(np.linalg.norm(vertices - (x, y, z), axis=1)))
    return Place(vec3(vertices[k]), vec3(-solid().mesh.normals[k]))


SIDE, TOP = place(0.03, 0.0, 0.1), place(-0.02, 0.0, 0.12)


def hold(body: Body, where: list[Place], delay: float) -> tuple[VirtualSession, list[VirtualUser]]:
    """Hands that press 5 mm deep and stay."""
    session = VirtualSession(body)
    scripts = [
        HandScript(depth=0.005, approach_at=1.2 + 0.3 * k, place=at) for k, at in enumerate(where)
    ]
    users = [
        session.join(f"hand {k}", script, delay=delay, seed=k) for k, script in enumerate(scripts)
    ]
    return session, users


@pytest.mark.parametrize(("where", "delay"), [([SIDE], 0.0), ([SIDE], 0.25), ([SIDE, TOP], 0.08)])
def test_hands_come_to_rest_at_the_forces_of_an_object_without_mass(
    where: list[Place], delay: float
) -> None:
    swinging, users = hold(jelly(0.2), where, delay)
    swinging.run(SETTLE)
    response = swinging.room.world.response
    assert isinstance(response, ModalResponse)
    assert 0.0 < response.felt < 0.9
    for user in users:
        assert np.ptp(user.force[-1000:]) < 0.01 * user.force[-1]
    still, expected = hold(solid(), where, delay)
    still.run(SETTLE)
    for user, other in zip(users, expected, strict=True):
        assert user.force[-1] == pytest.approx(other.force[-1], rel=0.01)


def test_a_hand_alone_with_a_law_of_the_paper_comes_to_rest() -> None:
    """It answers its own dent behind the delay; with a share of the swing it swung on for ever."""
    session = VirtualSession(jelly())
    script = HandScript(depth=0.005, approach_at=1.2, place=SIDE)
    user = session.join("hand", script, law=Law.PROPORTIONAL, delay=0.2)
    session.run(2.0 * SETTLE)
    response = session.room.world.response
    assert isinstance(response, ModalResponse)
    assert response.felt == 0.0
    assert np.ptp(user.force[-1000:]) < 0.1 * user.force[-1]


def test_a_hand_that_is_shown_all_of_it_behind_a_delay_swings(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def all_of_it(*_: object) -> float:
        return 1.0

    monkeypatch.setattr(felt_swing, "felt_fraction", all_of_it)
    session, (user,) = hold(jelly(0.05), [SIDE], 0.08)
    session.run(SETTLE)
    assert np.ptp(user.force[-1000:]) > 0.05 * max(user.force)
