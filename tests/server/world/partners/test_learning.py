"""Windows of samples, the estimate of a hand, and the glide of its model and lag."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.hand_model import USUAL_HAND, HandModel
from cohaptic.protocol.frame import MAX_FORCE
from cohaptic.vec import Vec3, scale
from cohaptic_server.numeric import Complex
from cohaptic_server.world.partners.hand_estimate import STEP, WINDOW
from cohaptic_server.world.partners.learning import (
    FIRST_LAG,
    Learned,
    Sampled,
    glide,
    hear,
    learn,
    unknown,
)
from cohaptic_server.world.partners.small_gain import LAG_DOWN, LAG_UP, LAGS, RATE_IN_NEED
from cohaptic_server.world.partners.wishes import next_wishes
from cohaptic_server.world.state import TickTime, Touch
from cohaptic_server.world.users import Wishes
from tests.server.touches import applied_of, side, touch, tracked_of, user_of
from tests.server.world.worlds import DT
from tests.strategies import vectors

OUT = (1.0, 0.0, 0.0)
C = 0.001 * np.array([[4.0, 2.0], [2.0, 4.0]])
BOTH = np.array([True, True])
LONGEST_GAP = 0.25  # s between samples of a window
models = st.builds(HandModel, st.floats(0.03, 0.8), st.floats(0.5, 20.0), st.floats(50.0, 1500.0))


def at(t: float, depth: float = 0.005, force: float = 2.0, user: int = 1) -> Touch:
    return touch(user, at=OUT, depth=depth, force=force, deflection=0.0, t_client=t)


def heard(learned: Learned, touches: Iterable[Touch]) -> Learned:
    for one in touches:
        learned = hear(learned, one)
    return learned


def pushed(hand: HandModel, seconds: float, seed: int, rate: float = 60.0) -> list[Touch]:
    """Samples of a hand that wants to be at one depth, and whose contact another one shakes."""
    rng, dt = np.random.default_rng(seed), 0.001
    phases = rng.uniform(0.0, 2.0 * np.pi, 12)
    x = v = 0.0
    found, sent = list[Touch](), 0.0
    for i in range(round(seconds / dt)):
        t = i * dt
        others = 4e-4 * float(np.sin(2.0 * np.pi * np.arange(0.7, 12.7) * t + phases).sum())
        force = max(0.0, 325.0 * (x + others))
        if t >= sent:
            found.append(at(t, x, force))
            sent += 1.0 / rate
        v += dt / hand.mass * (hand.stiffness * (0.02 - x) - force)
        v /= 1.0 + dt * hand.damping / hand.mass
        x += dt * v
    return found


def same(one: Learned, other: Learned) -> bool:
    """Whether all that is known is the same, to the last bit."""
    clouds, others = one.clouds, other.clouds
    return (
        (clouds.log == others.log).all()
        and (clouds.seed, clouds.windows) == (others.seed, others.windows)
        and (one.samples, one.model, one.lag, one.wanted, one.due)
        == (other.samples, other.model, other.lag, other.wanted, other.due)
    )  # fmt: skip


@given(st.lists(st.floats(0.001, LONGEST_GAP), min_size=1, max_size=60), st.floats(0.26, 5.0))
def test_a_gap_begins_the_window_again(gaps: list[float], gap: float) -> None:
    times = np.cumsum([3.0, *gaps]).tolist()
    learned = heard(unknown(1), map(at, times))
    again = times[-1] + gap
    learned = hear(learned, at(again))
    assert learned.samples == (Sampled(again, at(again).probe, at(again).force),)
    assert not learned.ready(1e9)


@given(st.lists(st.floats(-1.0, 0.0), min_size=1, max_size=5))
def test_a_sample_that_is_not_newer_is_passed_over(steps: list[float]) -> None:
    learned = heard(unknown(1), [at(5.0), at(5.1)])
    for step in steps:
        assert hear(learned, at(5.1 + step, depth=0.02)) is learned


@given(models, st.integers(0, 99))
def test_learning_is_a_function_that_leaves_what_it_was_given(hand: HandModel, seed: int) -> None:
    learned = heard(unknown(seed), pushed(hand, WINDOW + 0.2, seed))
    assert learned.ready(0.0)
    log = learned.clouds.log.copy()
    taken = [USUAL_HAND, USUAL_HAND]
    after = learn(learned, C, taken, 0, BOTH, 7.0)
    assert same(after, learn(learned, C, taken, 0, BOTH, 7.0))
    assert (learned.clouds.log == log).all()
    assert after.clouds.windows == 1
    assert after.due == 7.0 + STEP
    assert not after.ready(6.9 + STEP)
    # Model and lag move only with time; what they move to is in what patches can carry.
    assert (after.model, after.lag, after.samples) == (
        learned.model, learned.lag, learned.samples,
    )  # fmt: skip
    assert after.wanted[1] in LAGS
    low, high = (0.03, 0.5, 50.0), (0.8, 20.0, 1500.0)
    assert all(a <= x <= b for a, x, b in zip(low, after.wanted[0], high, strict=True))


@given(
    st.lists(
        st.tuples(
            st.sampled_from([5e-324, 1e-300, 1e-12, 1e-3, 0.016, 0.1, 0.2499]),
            vectors(10.0),
            vectors(MAX_FORCE),
        ),
        min_size=1, max_size=8,
    ),
    st.integers(1, 200),
    st.sampled_from([0.0, 1e-9, 1e5, -1e8, 1e8]),
)  # fmt: skip
def test_no_samples_make_learning_fail(
    hands: list[tuple[float, Vec3, Vec3]], repeats: int, start: float
) -> None:
    """Times of a client's clock are what a client says."""
    learned, t, tick = unknown(1), start, 0
    learned = hear(learned, at(t))
    for step, probe, force in hands:
        for i in range(repeats):
            t += step
            sign = (-1.0) ** i
            one = replace(at(t), probe=scale(probe, sign), force=scale(force, sign**2))
            learned = hear(learned, one)
    while not learned.ready(0.0):
        t, tick = t + 0.05, tick + 1
        learned = hear(learned, replace(at(t), force=scale(OUT, float(tick % 5))))
    after = learn(learned, C, [USUAL_HAND] * 2, 0, BOTH, 0.0)
    assert np.isfinite(after.clouds.log).all()
    assert np.isfinite([*after.wanted[0], after.wanted[1]]).all()
    assert len(learned.samples) <= 564


@pytest.mark.parametrize("t", [2.0**54, -1e15, 1.1e9])
def test_a_time_at_which_seconds_vanish_is_left_out(t: float) -> None:
    assert hear(unknown(1), at(t)).samples == ()


def test_a_hand_that_others_push_is_learned() -> None:
    hand, learned, used = HandModel(0.3, 3.0, 900.0), unknown(1), 0
    for one in pushed(hand, 10.0, 1):
        learned = hear(learned, one)
        if learned.ready(one.t_client):
            taken = [learned.model, USUAL_HAND]
            learned, used = learn(learned, C, taken, 0, BOTH, one.t_client), used + 1
        learned = glide(learned, 0.0, DT)
    assert used == 8  # after two seconds, and every second then
    found = learned.wanted[0]
    w = 2.0 * math.pi * np.arange(1.0, 8.0)

    def impedance(of: HandModel) -> Complex:
        return np.asarray(of.stiffness - of.mass * w**2 + 1j * w * of.damping)

    def error(of: HandModel) -> float:
        return float(np.abs(impedance(of) / impedance(hand) - 1.0).mean())

    assert error(found) < 0.35 < error(USUAL_HAND)


@pytest.mark.parametrize("touching", [False, True])
def test_a_hand_in_the_air_is_not_learned(touching: bool) -> None:
    """Nor one whose force the body does not carry."""
    learned = heard(unknown(1), (at(i * DT, force=0.0 if touching else 2.0) for i in range(140)))
    after = learn(learned, C, [USUAL_HAND] * 2, 0, np.array([touching, True]), 3.0)
    assert after.clouds is learned.clouds
    assert after.wanted == (USUAL_HAND, FIRST_LAG)
    assert not after.ready(3.9)


@given(models, st.sampled_from(LAGS.tolist()), st.floats(0.001, 0.1), st.integers(1, 30))
def test_model_and_lag_glide_to_those_wanted_and_stay_there(
    model: HandModel, late: float, dt: float, steps: int
) -> None:
    learned = replace(unknown(1), wanted=(model, late))
    for _ in range(steps):
        after = glide(learned, 0.0, dt)
        change = np.log(np.array(after.model) / np.array(learned.model))
        assert np.abs(change).max() <= RATE_IN_NEED * dt * (1.0 + 1e-9)
        assert -LAG_DOWN * dt - 1e-12 <= after.lag - learned.lag <= LAG_UP * dt + 1e-12
        learned = after
    for _ in range(60):
        learned = glide(learned, 0.0, 1.0)
    assert learned.model == pytest.approx(model, rel=1e-12)
    assert learned.lag == pytest.approx(late, abs=1e-12)


def test_nobody_learns_while_models_are_forbidden() -> None:
    samples = pushed(HandModel(0.3, 3.0, 600.0), 4.2, 1)
    wishes = Wishes()
    for tick in range(250):
        users = [user_of(samples[tick], force=2.0), user_of(touch(2, at=side(2.0)), force=2.0)]
        wishes = next_wishes(
            wishes, tracked_of(users), applied_of(users), np.zeros(2), C, np.full(2, 1e6), True,
            TickTime(tick + 1, tick * DT, DT, DT),
        )  # fmt: skip
    assert wishes.weight == 0.0
    assert wishes.hands[1].clouds.windows == 0
    assert wishes.hands[1].ready(4.0)
