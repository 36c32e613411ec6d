"""Laws of a whole session, in virtual time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cohaptic.control.law import Law
from cohaptic.simulated.hand import Hand, HandScript, Rhythm
from cohaptic_client.loop.safety import EXTERNAL_RATE, SAFETY_FADE_RATE
from cohaptic_experiments.virtual_session import PERIOD, VirtualSession
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.equilibrium import Equilibrium, RestingHand, solve


@pytest.fixture(scope="module")
def body() -> Balloon:
    return Balloon(BalloonSettings(subdivisions=2, contact_radius=0.03))


def scripts(n: int, depth: float = 0.015, approach_at: float = 1.0) -> list[HandScript]:
    return [
        HandScript(2.0 * math.pi * i / n - math.pi, depth=depth, approach_at=approach_at)
        for i in range(n)
    ]


def reference(body: Balloon, hands: list[HandScript]) -> Equilibrium:
    info = describe(body)
    return solve(
        body,
        [
            RestingHand(s.intention(info.center, info.radius).tip(1.0), s.hand.stiffness)
            for s in hands
        ],
    )


@pytest.mark.parametrize(("n", "delay"), [(1, 0.5), (2, 0.0), (2, 0.25), (3, 0.08), (4, 0.1)])
def test_predictive_forces_are_the_reference_at_any_delay(
    body: Balloon, n: int, delay: float
) -> None:
    hands = scripts(n, approach_at=1.0 + 2 * delay)
    session = VirtualSession(body)
    for i, script in enumerate(hands):
        session.join(f"user{i}", script, delay=delay, jitter=0.2 * delay, seed=i)
    session.run(3.5 + 14 * delay)
    expected = reference(body, hands)
    for i, user in enumerate(session.users.values()):
        assert user.force[-1] == pytest.approx(expected.force[i], rel=0.01)
        assert user.felt[-1] == pytest.approx(expected.felt_from_others[i], rel=0.02, abs=1e-4)
        assert np.ptp(user.force[-300:]) < 0.05


def largest_step(force: list[float]) -> float:
    return float(np.abs(np.diff(force)).max())


def test_a_lost_client_is_no_more_abrupt_than_one_that_lets_go(body: Balloon) -> None:
    session = VirtualSession(body)
    press = HandScript(math.pi, depth=0.02, rhythm=Rhythm(3.0))
    session.join("left", press, delay=0.02)
    right = session.join("right", HandScript(0.0, depth=0.01), delay=0.02)
    session.run(1.04 + 3.0 + 1.4)  # pressed once, released, still off
    letting_go = largest_step(right.force[3800:])
    session.run(1.4)  # pressed again
    pressed = right.force[-1]
    session.drop("left")
    session.run(0.6)
    assert largest_step(right.force[-600:]) <= letting_go
    assert right.force[-1] < 0.6 * pressed

    session.join("left", HandScript(math.pi, depth=0.02), delay=0.02)
    session.run(3.0)
    assert right.force[-1] == pytest.approx(pressed, rel=0.02)


def test_a_silent_server_fades_the_force_within_the_stated_time(body: Balloon) -> None:
    session = VirtualSession(body)
    user = session.join("user", scripts(1)[0], delay=0.02)
    session.run(3.0)
    pressed = user.force[-1]
    assert pressed > 1.0
    user.listening = False
    limits = user.settings.limits
    # The hand goes in as the force gives way, which makes the law ask for more: some longer.
    fade = 2.0 * max(limits.fade_time, pressed / SAFETY_FADE_RATE)
    session.run(limits.silent_after + fade)
    assert user.force[-1] == 0.0
    assert largest_step(user.force[-1000:]) < EXTERNAL_RATE * PERIOD
    user.listening = True
    session.run(3.0)
    assert user.force[-1] == pytest.approx(pressed, rel=0.01)
    assert largest_step(user.force[-3000:]) < EXTERNAL_RATE * PERIOD


def test_a_stalled_uplink_lets_the_others_go_and_brings_them_back(body: Balloon) -> None:
    session = VirtualSession(body)
    left, right = (session.join(f"user{i}", s, delay=0.01) for i, s in enumerate(scripts(2)))
    session.run(3.0)
    together = right.force[-1]
    left.talking = False
    session.run(1.5)
    alone = right.force[-1]
    assert alone < 0.8 * together
    left.talking = True
    session.run(1.0)
    assert right.force[-1] == pytest.approx(together, rel=0.02)
    assert largest_step(right.force[3000:]) < 0.02


def test_a_neighbour_who_comes_never_jolts_and_makes_nobody_softer(body: Balloon) -> None:
    """With eight users the room gets a lag; with every arrival it grows."""
    session = VirtualSession(body)
    hands = scripts(8, depth=0.008)
    first = session.join("user0", hands[0], delay=0.02)
    session.run(2.5)
    lags = [session.room.world.room.lag]
    for i in range(1, 8):
        session.join(f"user{i}", hands[i], delay=0.02, seed=i)
        session.run(0.4)
        lags.append(session.room.world.room.lag)
    session.run(2.0)
    assert lags[0] == 0.0
    assert lags[-1] > 0.03
    assert session.room.world.room.margin > 1.0
    patch = first.state.patch
    assert patch is not None
    assert first.state.k_h == pytest.approx(patch.k_o, rel=1e-3)
    assert patch.room.lag == pytest.approx(session.room.world.room.lag, rel=0.01)
    assert max(first.unexplained) <= EXTERNAL_RATE * PERIOD + 1e-6
    # And who leaves takes the lag away, as little of a jolt.
    for i in range(1, 8):
        session.drop(f"user{i}")
        session.run(0.3)
    session.run(3.0)
    assert session.room.world.room.lag == 0.0
    assert max(first.unexplained) <= EXTERNAL_RATE * PERIOD + 1e-6


def test_wild_hands_do_not_make_a_stable_pair_swing(body: Balloon) -> None:
    session = VirtualSession(body)
    hand = Hand(mass=0.1, damping=6.0, stiffness=800.0)
    for i in range(2):
        session.join(
            f"user{i}", HandScript(math.pi * i, depth=0.015, hand=hand), delay=0.15, seed=i
        )
    session.run(7.0)
    for user in session.users.values():
        assert np.ptp(user.force[-500:]) < 0.05


def test_friction_holds_the_tip_and_disturbs_nobody(body: Balloon) -> None:
    """Three users at 80 ms, one with friction: all at rest, its force within the cone."""
    session = VirtualSession(body)
    users = [
        session.join(f"user{i}", script, delay=0.08, jitter=0.01, seed=i, friction=mu)
        for (i, script), mu in zip(enumerate(scripts(3)), (0.0, 0.0, 0.4), strict=True)
    ]
    session.run(6.0)
    rough = users[2].state
    assert rough.sight is not None
    normal = np.array(rough.sight.normal)
    along = np.array(rough.friction.force)
    pressed = np.array(rough.safety.force) @ normal
    assert abs(along @ normal) < 1e-9
    assert 0.1 < np.linalg.norm(along) <= 0.4 * pressed * 1.001
    assert all(np.ptp(user.force[-500:]) < 0.02 for user in users)


@pytest.mark.parametrize("delay", [0.0, 0.08])
def test_a_change_of_law_in_contact_is_no_step(body: Balloon, delay: float) -> None:
    """Two users press; one goes through every law; at most 2 % of the force in a period."""
    session = VirtualSession(body)
    users = [
        session.join(f"user{i}", script, delay=delay, seed=i, geometry="mesh")
        for i, script in enumerate(scripts(2, approach_at=1.0 + 2 * delay))
    ]
    session.run(4.0)
    seen = {Law.PREDICTIVE: users[0].force[-1]}
    for law in (Law.PROPORTIONAL, Law.PI, Law.PREDICTIVE, Law.PI, Law.PROPORTIONAL, Law.PREDICTIVE):
        before = len(users[0].force) - 1
        session.set_law("user0", law)
        session.run(0.3 if law is Law.PI else 4.0)
        for user in users:
            force = np.array(user.force[before:])
            assert (np.abs(np.diff(force)) <= 0.02 * force[:-1]).all()
        if law is Law.PROPORTIONAL:
            # And it did change: the softer law gives less.
            assert users[0].force[-1] < 0.7 * seen[Law.PREDICTIVE]
    assert users[0].state.law is Law.PREDICTIVE
    assert users[0].force[-1] == pytest.approx(seen[Law.PREDICTIVE], rel=0.01)
