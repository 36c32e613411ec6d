"""The force on a hand holds to its limits whatever server, link, device and machine do."""

from __future__ import annotations

import math
from dataclasses import replace

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from cohaptic.vec import ZERO, is_finite, norm, sub
from cohaptic_client.loop.passivity import RAMP, SLOW
from cohaptic_client.loop.safety import BACKSTOP, EXTERNAL_RATE, Mode
from tests.client.loop.attacks import (
    PERIOD,
    Event,
    Hand,
    Way,
    anything,
    creeps,
    crosses,
    hands,
    punctual,
    servers,
    slides,
    trembles,
    trembles_in,
)
from tests.examples_of_laws import examples

ROUNDING = 1e-9  # N
MOVING = (creeps, trembles, trembles_in, crosses, slides)
# Half a second of pressing comes before each example, and a second of silence or two behind it: to
# make one that fails smaller would take minutes.
attacks = settings(
    max_examples=examples(100),
    deadline=None,
    phases=(Phase.explicit, Phase.reuse, Phase.generate),
    suppress_health_check=[HealthCheck.data_too_large],
)


def check(hand: Hand) -> None:
    """What holds of every force that was written."""
    limit = hand.settings.limits.max_force
    for n, force in enumerate(hand.forces):
        assert is_finite(force)
        assert norm(force) <= limit + ROUNDING, n
    for n, (change, allowed) in enumerate(zip(hand.steps(), hand.allowed[1:], strict=True)):
        assert change <= allowed * (1.0 + 1e-9) + ROUNDING, n


@given(hands(), st.lists(anything, max_size=12))
@attacks
def test_no_attack_exceeds_a_limit_or_a_rate_and_the_force_ends_at_zero(
    hand: Hand, events: list[Event]
) -> None:
    """Patches that are no patches, times that go back, devices that are nowhere."""
    pressed = norm(hand.forces[-1])
    assert pressed > 0.5
    hand.suffer(events)
    hand.silence()
    check(hand)
    assert hand.forces[-1] == ZERO


@given(hands(), st.lists(servers, max_size=12))
@attacks
def test_no_server_moves_a_resting_hand_faster_than_others_may(
    hand: Hand, events: list[Event]
) -> None:
    """Whatever it says within the protocol, in whatever order, at whatever times."""
    start = len(hand.forces)
    hand.suffer(events)
    hand.silence()
    check(hand)
    allowed = max(hand.settings.limits.max_rate, 1e-9)
    for change, limit in zip(hand.steps(start), hand.allowed[start:], strict=True):
        counted = limit / max(allowed, 75.0 * hand.settings.limits.max_force)
        # The second order of a turn with it.
        assert change <= BACKSTOP * EXTERNAL_RATE * counted + ROUNDING
    assert hand.forces[-1] == ZERO


@given(
    hands(),
    st.sampled_from([0.05, 0.1, 0.3, 0.5]),
    st.integers(30, 100),
    st.lists(punctual, min_size=1, max_size=12),
)
@attacks
def test_a_hand_that_has_rested_for_30_ms_is_as_safe_as_one_that_never_moved(
    hand: Hand, speed: float, rest: int, events: list[Event]
) -> None:
    """Also beside models of others, which answered its motion."""
    hand.tap(speed, rest)
    start = len(hand.forces)
    hand.suffer(events)
    for change in hand.steps(start):
        assert change <= BACKSTOP * EXTERNAL_RATE * PERIOD + ROUNDING
    felt = hand.forces[start - 1 :]
    for before, after in zip(felt, felt[20:], strict=False):
        assert norm(sub(after, before)) <= 20.0 * BACKSTOP * EXTERNAL_RATE * PERIOD + ROUNDING


@given(hands(), st.lists(servers, max_size=12), st.sampled_from(MOVING))
@attacks
def test_no_server_moves_a_moving_hand_by_more_than_its_way_and_others_explain(
    hand: Hand, events: list[Event], way: Way
) -> None:
    """Nothing of the way is saved up for later."""
    hand.way, start = way, len(hand.forces)
    # A way in no time is held back by `max_rate`, and so comes later.
    hand.suffer([replace(e, dts=tuple(max(PERIOD, dt) for dt in e.dts)) for e in events])
    check(hand)
    limits, most_damping = hand.settings.limits, hand.settings.max_damping
    spring = hand.settings.max_stiffness * math.hypot(1.0, hand.settings.friction)
    release = 75.0 * limits.max_force
    for n, change in enumerate(hand.steps(start), start):
        counted = hand.allowed[n] / max(limits.max_rate, release)
        # Models of other hands answer at twice the hand's speed of the last 30 ms, at most.
        own = spring * (hand.ways[n] + 2.0 * max(hand.ways[max(0, n - 30) : n + 1]))
        own += most_damping * norm(sub(hand.velocities[n], hand.velocities[n - 1]))
        speed = norm(hand.velocities[n])
        if speed > SLOW:  # the damping comes and goes, and doubles a force that it is cut to
            own += spring * hand.ways[n] + speed * most_damping * counted / RAMP
        others = BACKSTOP * EXTERNAL_RATE * counted
        assert change <= own + others + ROUNDING, n


@given(hands(), st.lists(anything, max_size=6))
@attacks
def test_after_an_attack_a_hand_that_lifts_off_feels_the_object_again(
    hand: Hand, events: list[Event]
) -> None:
    """Nothing of it stays in the loop's memory; a fault that latches waits for its word."""
    hand.suffer(events)
    hand.silence()
    hand.lift()  # to be put there at once is a jump, so a fault, too
    held = hand.state.safety.mode is Mode.FAULT
    assert not held or hand.settings.limits.latch
    hand.press()
    if held:
        assert set(hand.forces[-400:]) == {ZERO}
        hand.state = hand.state.acknowledged()
        hand.retreat()
        hand.press()
    check(hand)
    assert norm(hand.forces[-1]) > 0.5
    assert hand.state.safety.fault == ""


def test_a_period_is_a_millisecond() -> None:
    assert Hand.__dataclass_fields__["now"].default == 100.0
    assert PERIOD == 0.001
