"""The ledger and the budget of a period, whatever surfaces come and hands do."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import settings as tried
from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3
from cohaptic.control.law import Law
from cohaptic.protocol.patch import Patch
from cohaptic.vec import Vec3, norm, sub
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.budget import Budget
from cohaptic_client.loop.ledger import ledger_of
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.rules.guard import own_force
from cohaptic_client.loop.safety import EXTERNAL_RATE, SafetyLimits
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.step import step
from tests.client.loop.loop_cases import PERIOD, TICK, at, engaged, near_patches, probes
from tests.client.plane import PLANE
from tests.examples_of_laws import examples

ROUGH = Compliance3(0.003, 0.005, 0.004, 1e-3, 1e-3, -1e-3)


@given(
    st.floats(0.0, 1.0),
    st.lists(st.tuples(st.booleans(), st.floats(0.0, 1.0)), max_size=20),
)
def test_a_budget_is_never_overdrawn(amount: float, drawn: list[tuple[bool, float]]) -> None:
    budget, taken = Budget(amount), 0.0
    for reserve, wanted in drawn:
        part = budget.reserve(wanted) if reserve else budget.take(wanted)
        assert 0.0 <= part <= (amount if reserve else wanted)
        taken += part
        assert budget.left >= 0.0
    assert taken + budget.left == pytest.approx(amount, abs=1e-12)


@given(
    st.lists(st.tuples(near_patches, st.integers(1, 20), probes, st.booleans()), max_size=6),
    st.sampled_from([0.0, 1.0]),
    st.sampled_from([0.0, 0.5]),
    st.sampled_from([0.0, 8.0]),
    st.sampled_from([1.0, 10.0]),
)
@tried(max_examples=examples(60), deadline=None)
def test_the_entries_are_the_force_and_nobody_takes_more_than_there_is(
    arrivals: list[tuple[Patch, int, Vec3, bool]],
    smoothing: float,
    friction: float,
    damping: float,
    limit: float,
) -> None:
    """Any law, silence, jumps of the tip, and surfaces that jump."""
    limits = SafetyLimits(max_force=limit, stale=0.05)
    settings = LoopSettings(
        TICK, limits, smoothing=smoothing, friction=friction, max_damping=damping
    )
    compliance = ROUGH if friction > 0.0 else None
    state, now, tip = engaged(replace(PLANE, compliance=compliance), settings), 10.0, probes_from()
    for tick, (patch, periods, goal, silent) in enumerate(arrivals, start=2):
        patch = replace(patch, tick=tick, compliance=compliance, c_ii=1.0 / patch.k_h)
        state = receive(state, patch, now, settings)
        if silent:
            state = state.silenced()
        for i in range(1, periods + 1):
            way = i / periods
            place = tuple(a + way * (b - a) for a, b in zip(tip, goal, strict=True))
            now += PERIOD
            before = state
            state, period = step(state, at(place), now, settings)  # type: ignore[arg-type]
            assert sum(ledger_of(period, limit)) == pytest.approx(norm(period.force), abs=1e-9)
            spent = (
                period.spent_gain + period.spent_fades + period.spent_turn + period.spent_models
                + period.spent_depth
            )  # fmt: skip
            assert spent <= EXTERNAL_RATE * period.counted * (1.0 + 1e-9)
            if before.sight is not None and period.safety.left == 0.0 and not period.trouble.cause:
                change = norm(sub(period.force, before.safety.force))
                assert change <= model_change(before, period) + spent_at_limit(period)
            assert period.budget.left >= 0.0
        tip = goal


def model_change(before: LoopState, period: Period) -> float:
    """The change of a force that the hand's own motion explains, now or held back before [N]."""
    velocity = norm(sub(period.sample.velocity, before.safety.velocity))
    damping = max(period.damping, before.passivity.damping)
    return own_force(period) + before.safety.own + damping * velocity


def spent_at_limit(period: Period) -> float:
    """The change that nothing of the hand's own explains: the budget, but for its rounding [N]."""
    return EXTERNAL_RATE * period.counted * (1.0 + 2e-9)


def test_all_fades_and_a_gain_together_take_no_more_than_there_is() -> None:
    """A gain that falls, a fade after a silence, and another law, all at once."""
    settings = LoopSettings(TICK, SafetyLimits(), smoothing=0.0)
    state, now, worst = engaged(PLANE, settings), 10.0, 0.0
    for tick in range(2, 120):
        law = Law.PROPORTIONAL if tick > 60 else Law.PREDICTIVE
        k_h = 200.0 if tick % 2 else 900.0
        patch = replace(PLANE, tick=tick, law=law, k_h=k_h, c_ii=1.0 / k_h)
        if not 55 < tick < 62:
            state = receive(state, patch, now, settings)
        for _ in range(round(TICK / PERIOD)):
            now += PERIOD
            before = state.safety
            depth = min(0.008, 0.0002 * (now - 10.0) / PERIOD)
            state, period = step(state, at((0.0, 0.0, -depth)), now, settings)
            if depth == 0.008 and now > 10.2:
                worst = max(worst, norm(sub(period.force, before.force)))
    assert 0.5 * EXTERNAL_RATE * PERIOD < worst <= EXTERNAL_RATE * PERIOD * (1.0 + 2e-9)


def probes_from() -> Vec3:
    """Where a hand is that begins on the plane."""
    return (0.0, 0.0, 0.0)
