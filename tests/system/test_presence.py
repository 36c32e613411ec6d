"""The effect of a hand in the air, and of one that touches late, on the hands that press already.

The third user of each session has a device that may damp nothing. Such a device needs a far longer
lag than the others, so that the lag shows at once whether the user counts.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from cohaptic.simulated.hand import Hand, HandScript, Intention, Rhythm
from cohaptic.vec import add, scale
from cohaptic_experiments.virtual_session import PERIOD, VirtualSession, VirtualUser
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.state import NEGLIGIBLE

DELAY = 0.02  # s, one way
DEPTH = 0.008  # m
# N; more than the rounding of a position of 0.1 m to 32 bits, 7e-9 m, makes of a force at the
# stiffness of any contact here, at most 600 N/m.
ROUNDING = 1e-5
SHORT, LONG = 0.05, 0.2  # s; the lag is below the one without the third user, above the other with
HEAVY = Hand(mass=0.5, damping=2.0, stiffness=300.0)
NEVER = 1e9  # s


def two_who_press(body: Balloon, hand: Hand | None = None, damping: float = 8.0) -> VirtualSession:
    """Two hands on opposite sides of the balloon, which begin to press at once."""
    session = VirtualSession(body)
    for i, angle in enumerate((0.0, math.pi)):
        script = HandScript(angle, depth=DEPTH, hand=hand or Hand())
        session.join(f"user{i}", script, delay=DELAY, seed=i, max_damping=damping)
    return session


def third(
    session: VirtualSession,
    height: float,
    *,
    approach_at: float = NEVER,
    depth: float = DEPTH,
    rhythm: Rhythm | None = None,
    hand: Hand | None = None,
) -> VirtualUser:
    """A user between the two, on a device that may damp nothing.

    Args:
        height: Of the tip over the surface at first [m].
        approach_at: When it begins to press [s].
        depth: To which it presses [m]; below 0 it stays in the air.
        rhythm: Of its pressing.
        hand: Its mechanics.
    """
    info = describe(session.room.body)
    path = Intention(
        add(info.center, scale((0.0, 1.0, 0.0), info.radius)),
        (0.0, -1.0, 0.0),
        depth,
        clearance=height,
        approach_at=approach_at,
        approach_time=0.1,
        rhythm=rhythm,
    )
    script = HandScript(hand=hand or Hand())
    return session.join("third", script, delay=DELAY, seed=7, max_damping=0.0, intention=path)


def forces(session: VirtualSession) -> Floats:
    """Forces of the two who press, shape (2, periods) [N]."""
    return np.array([session.users[f"user{i}"].force for i in range(2)])


def lags(session: VirtualSession, seconds: float) -> list[float]:
    """Lags of the room in every period of the next seconds [s]."""
    found: list[float] = []
    for _ in range(round(seconds / PERIOD)):
        session.run(PERIOD)
        found.append(session.room.world.room.lag)
    return found


@pytest.fixture(scope="module")
def alone(small_balloon: Balloon) -> tuple[Floats, list[float]]:
    """Forces and lags of two hands without a third."""
    session = two_who_press(small_balloon)
    found = lags(session, 2.0)
    return forces(session), found


@pytest.mark.parametrize("height", [0.006, 0.01, 0.02, 0.03])
def test_a_hand_in_the_air_changes_neither_the_lag_nor_the_forces_of_others(
    small_balloon: Balloon, alone: tuple[Floats, list[float]], height: float
) -> None:
    session = two_who_press(small_balloon)
    third(session, height)
    found = lags(session, 2.0)
    assert found == pytest.approx(alone[1], rel=1e-9)
    assert 0.0 < found[-1] < SHORT
    assert np.abs(forces(session) - alone[0]).max() < ROUNDING


@pytest.mark.parametrize("hand", [Hand(), HEAVY], ids=["usual hand", "heavy hand"])
def test_a_hand_that_touches_raises_the_lag_in_the_tick_of_its_first_force(
    small_balloon: Balloon, hand: Hand
) -> None:
    session = two_who_press(small_balloon)
    user = third(session, 0.01, approach_at=1.5, hand=hand)
    before = 0.0
    while True:
        session.run(PERIOD)
        world = session.room.world
        if user.number in world.users and world.users[user.number].force > NEGLIGIBLE:
            break
        before = world.room.lag
        assert session.now < 103.0
    assert 0.0 < before < SHORT
    assert world.room.lag > LONG
    # All forces of later ticks pass the longer lag.
    assert min(lags(session, 0.5)) > LONG


def test_heavy_hands_without_damping_come_to_rest_after_a_late_touch(
    small_balloon: Balloon,
) -> None:
    """The first force reaches the body before the lag has risen."""
    session = two_who_press(small_balloon, HEAVY, damping=0.0)
    user = third(session, 0.02, approach_at=3.0, hand=HEAVY)
    session.run(5.0)
    early = np.ptp(forces(session)[:, 3000:], axis=1).max()
    session.run(4.0)
    late = np.ptp(forces(session)[:, -1500:], axis=1).max()
    assert user.force[-1] > 0.1
    assert late < 0.2 * early
