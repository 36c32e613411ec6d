"""The campaign's simplified room against the real room and client, and the campaign's verdicts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3, FrictionState, friction_step
from cohaptic.control.law import Law
from cohaptic.control.laws.pi import IntegralState, proportional_integral_step
from cohaptic.simulated.hand import Hand, HandScript, Intention
from cohaptic_client.loop.passivity import dissipate
from cohaptic_experiments.campaign import simulation
from cohaptic_experiments.campaign.compiled import compiled
from cohaptic_experiments.campaign.hand_motion import CLEARANCE, PRESS_TIME
from cohaptic_experiments.campaign.hands import FAR_OFF, RULES, STEP, run
from cohaptic_experiments.campaign.kernel import EVERY, FIGURES, THRESHOLDS, T
from cohaptic_experiments.campaign.rows import ROWS, WEAK_OFF, Row
from cohaptic_experiments.campaign.simulation import play, trace
from cohaptic_experiments.campaign.trials import (
    MAX_USERS,
    Trial,
    draw,
    no_motion,
    without_coupling,
)
from cohaptic_experiments.campaign.variants import Coupling, Variant, lag_of
from cohaptic_experiments.campaign.verdicts import judge
from cohaptic_experiments.campaign.wide_trials import BUDGETS, draw_wide
from cohaptic_experiments.outcome import Options
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.spring import Spring, SpringSettings
from cohaptic_server.world.applied_forces import allowed_shares, limit_forces
from tests.examples_of_laws import examples
from tests.experiments.quick_run import check_quick_run

pytestmark = pytest.mark.night  # its kernel is compiled first, for half a minute

OURS = RULES[-1]
FAST_PI, FAST_DISSIPATE = compiled(proportional_integral_step), compiled(dissipate)
FAST_FRICTION = compiled(friction_step)
FAST_SHARES, FAST_BOUNDED = compiled(allowed_shares), compiled(limit_forces)


def two_on_a_plate(law: Law, delay: float) -> Trial:
    """Two hands on one rigid plate on a spring: the strongest coupling that there is."""
    C = np.full((2, 2), 1.0 / 300.0)
    each = np.ones(2)
    return Trial(
        object="plate",
        C=C + 1e-9 * np.eye(2),
        mass=0.15 * each,
        damping=8.0 * each,
        stiffness=np.array([400.0, 250.0]),
        depth=np.array([0.012, 0.009]),
        press_at=1.5 * each,
        simulation_period=1.0 / 60.0,
        up=delay * each,
        down=delay * each,
        jitter=0.0 * each,
        seed=1,
        motion=no_motion(2),
    )


@pytest.mark.parametrize("law", Law)
@pytest.mark.parametrize("delay", [0.0, 0.08])
def test_the_campaign_agrees_with_the_real_room_and_client(law: Law, delay: float) -> None:
    trial, seconds = two_on_a_plate(law, delay), 6.0
    session = VirtualSession(Spring(SpringSettings(k_o=300.0)))
    users = [
        session.join(
            f"user{i}",
            HandScript(hand=Hand(trial.mass[i], trial.damping[i], trial.stiffness[i])),
            law=law,
            delay=delay,
            intention=Intention(
                surface=(0.0, side, 0.0),
                direction=(-1.0, 0.0, 0.0),
                depth=trial.depth[i],
                clearance=CLEARANCE,
                approach_at=1.5,
                approach_time=PRESS_TIME,
            ),
        )
        for i, side in ((0, -0.05), (1, 0.05))
    ]
    session.run(seconds)
    real = np.array([user.force for user in users]).T[::EVERY]
    _, ours = trace(trial, Variant(law), seconds=seconds)
    # From when the safety layer gives the force in full; its engagement is not in the campaign. And
    # the campaign takes the longest delay that the server could measure: I is a little smaller.
    start = round(2.2 / (T * EVERY))
    scale = np.abs(real).max()
    assert np.abs(real[start:] - ours[start:]).max() < 0.15 * scale
    settled = round(5.0 / (T * EVERY))
    assert real[settled:] == pytest.approx(ours[settled:], abs=0.02 * scale)


@given(st.floats(0, 1), st.floats(-0.01, 0.03), st.floats(1, 800), st.floats(0, 1e4))
@settings(max_examples=examples(30), deadline=None)
def test_compiled_functions_are_the_functions(
    share: float, depth: float, k_h: float, gain: float
) -> None:
    """Numba compiles the same source; here both run, on the functions with most branches."""
    state = IntegralState(share, 0.0, depth)
    pi = (state, depth, k_h, gain, THRESHOLDS, 0.1, 10.0, T, 0.1 * depth, 0.02)
    for ours, theirs in zip(FAST_PI(*pi), proportional_integral_step(*pi), strict=True):
        assert np.array(ours) == pytest.approx(np.array(theirs), rel=1e-12)
    taken = (0.01 * share, 4.0, k_h * 0.01, depth, T, 8.0)
    assert FAST_DISSIPATE(*taken) == pytest.approx(dissipate(*taken), rel=1e-12)
    C = Compliance3(0.004, 0.003, 0.002, 0.0005, 0.0, 0.0001)
    stuck = FrictionState((0.0, 1e-3 * share, 0.0), (0.0, share, 0.0), (0.0, 0.0, depth), True)
    rubbed = (
        stuck, (0.0, depth, 0.0), (0.0, 0.0, 0.01), (1.0, 0.0, 0.0), share, C, 0.4, 1.0, k_h, 0.01
    )  # fmt: skip
    fast, slow = FAST_FRICTION(*rubbed), friction_step(*rubbed)
    for ours, theirs in zip(fast, slow, strict=True):
        assert np.array(ours) == pytest.approx(np.array(theirs), rel=1e-9, abs=1e-15)


@given(st.lists(st.floats(0.0, 100.0), min_size=1, max_size=8), st.floats(1.0, 5000.0))
@settings(max_examples=examples(30), deadline=None)
def test_compiled_limits_are_the_servers(demands: list[float], k: float) -> None:
    change, n = np.array(demands), len(demands)
    C = np.full((n, n), 0.5 / k) + 0.5 / k * np.eye(n)
    taken = (change, np.full(n, k), C, 1.0)
    assert FAST_SHARES(*taken) == pytest.approx(allowed_shares(*taken), rel=1e-12)
    whole = (change, np.full(n, np.inf))
    assert FAST_BOUNDED(*whole) == pytest.approx(limit_forces(*whole), rel=1e-12)


@given(st.integers(0, 2**31), st.integers(0, 10_000))
@settings(max_examples=examples(50), deadline=None)
def test_trials_are_rooms_of_the_published_ranges(seed: int, index: int) -> None:
    trial = draw(seed, index)
    n = len(trial.C)
    assert 1 <= n <= MAX_USERS
    assert np.linalg.eigvalsh(trial.C).min() > 0.0
    assert 50.0 * 0.99 <= 1.0 / np.diag(trial.C).mean() <= 800.0 * 1.01
    for values, low, high in (
        (trial.mass, 0.05, 0.5),
        (trial.damping, 1.0, 10.0),
        (trial.stiffness, 100.0, 1000.0),
        (trial.up, 0.0, 0.25),
        (trial.down, 0.0, 0.25),
        (trial.jitter, 0.0, 0.06),
    ):
        assert values.shape == (n,)
        assert ((low <= values) & (values <= high)).all()
    assert 20.0 <= 1.0 / trial.simulation_period <= 100.0
    assert (draw(seed, index).C == trial.C).all()
    # Equilibrium: pressed tips on the surface, the others off it.
    f = trial.reference
    gap = (trial.C + np.diag(1.0 / trial.stiffness)) @ f - trial.depth
    assert (f >= 0.0).all()
    assert gap[f > 0.0] == pytest.approx(0.0, abs=1e-9)
    assert (gap[f == 0.0] >= -1e-9).all()


def test_a_swing_is_unstable_and_a_creep_is_not() -> None:
    trials = [draw(0, i) for i in range(3)]
    t = np.linspace(0.0, 4.0, 400)[:, None]
    top = max(trial.reference.max() for trial in trials)
    tails = np.zeros((3, 400, MAX_USERS))
    tails[0] += top * (1.0 + 0.2 * np.sin(9.0 * t))  # goes on
    tails[1] += top * (1.0 + 0.5 * np.exp(-1.0 * t) * np.sin(9.0 * t))  # dies out
    tails[2] += top * (1.0 - 0.5 * np.exp(-0.3 * t))  # creeps
    verdicts = judge(trials, tails, np.ones((3, FIGURES)))
    assert verdicts.unstable.tolist() == [True, False, False]
    assert verdicts.slow[2]


def test_trials_are_the_same_however_many_run_beside_them() -> None:
    trials = [draw(5, i) for i in range(12)]
    together = play(trials, OURS, seconds=2.0)
    alone = play(trials[7:8], OURS, seconds=2.0)
    assert together.error[7] == alone.error[0]


def test_hands_that_share_nothing_feel_exactly_their_own_object() -> None:
    trials = [without_coupling(draw(9, i)) for i in range(20)]
    assert play(trials, OURS, seconds=8.0).errors.max() < 1e-3


def test_with_neither_lag_nor_anticipation_the_room_swings(monkeypatch: pytest.MonkeyPatch) -> None:
    """The check of the campaign can fail: without both it does, with the layer and without."""
    trials = [draw(0, i) for i in range(300)]
    assert play(trials, OURS, seconds=8.0).unstable.sum() == 0
    assert play(trials, OURS.without_passivity, seconds=8.0).unstable.sum() == 0

    def none(trial: Trial, variant: Variant) -> tuple[float, Coupling]:
        return 0.0, lag_of(trial, variant)[1]._replace(share=-1.0)

    monkeypatch.setattr(simulation, "lag_of", none)
    assert play(trials, OURS, seconds=8.0).unstable.sum() > 0


@pytest.mark.parametrize("row", [*ROWS, WEAK_OFF], ids=lambda row: row.name)
def test_the_rows_of_the_campaign_hold_on_a_few_of_their_rooms(row: Row) -> None:
    verdicts = play([row.draw(0, i) for i in range(24)], row.variant, seconds=row.seconds)
    assert verdicts.unstable.sum() == 0
    assert verdicts.step.max() <= STEP + 1e-9


@given(st.integers(0, 2**31), st.integers(0, 10_000))
@settings(max_examples=examples(50), deadline=None)
def test_the_wide_ensemble_is_as_described(seed: int, index: int) -> None:
    trial = draw_wide(seed, index, 40.0)
    assert np.linalg.eigvalsh(trial.C).min() > 0.0
    assert 50.0 * 0.99 <= 1.0 / np.diag(trial.C).mean() <= 10_000.0 * 1.01
    assert trial.max_stiffness is not None
    assert trial.budget is not None
    assert ((trial.max_stiffness >= 500.0) & (trial.max_stiffness <= 5000.0)).all()
    assert set(trial.budget.tolist()) <= set(BUDGETS)
    # Colgate: a device that renders K stably has physical damping of at least K T / 2.
    assert (trial.damping >= 0.3 + 0.5 * trial.max_stiffness * T).all()
    assert (trial.jitter <= 0.4).all()
    assert (draw_wide(seed, index, 40.0).motion == trial.motion).all()


def test_one_trial_is_drawn_alone() -> None:
    outcome = run(Options(seed=0, trial=38), lambda _: None)
    assert [row[0] for row in outcome.table.rows] == [rule.name for rule in RULES]
    assert outcome.numbers["trial"] == 38
    assert outcome.holds == (
        not outcome.table.rows[-1][1] and float(outcome.table.rows[-1][2] or 0.0) <= FAR_OFF
    )
    assert replace(Options(), trial=1).trial == 1


def test_the_experiment_holds_and_writes_its_outcome(tmp_path: Path) -> None:
    check_quick_run("hands", tmp_path)
