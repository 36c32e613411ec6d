"""The campaign's simplified room against the real room and client, and the campaign's verdicts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic.simulated.hand import Hand, HandScript, Intention
from cohaptic_experiments.campaign import simulation
from cohaptic_experiments.campaign.compiled import compiled
from cohaptic_experiments.campaign.hand_motion import CLEARANCE, PRESS_TIME
from cohaptic_experiments.campaign.hands import RULES, STEP
from cohaptic_experiments.campaign.kernel import EVERY, T
from cohaptic_experiments.campaign.rows import ROWS, WEAK_OFF, Row
from cohaptic_experiments.campaign.simulation import play, trace
from cohaptic_experiments.campaign.trials import (
    Trial,
    draw,
    no_motion,
)
from cohaptic_experiments.campaign.variants import Coupling, Variant, lag_of
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.spring import Spring, SpringSettings
from cohaptic_server.world.applied_forces import allowed_fractions, limit_forces
from tests.examples_of_laws import examples
from tests.experiments.quick_run import check_quick_run

pytestmark = pytest.mark.night  # its kernel is compiled first, for half a minute

OURS = RULES[-1]
FAST_FRACTIONS, FAST_BOUNDED = compiled(allowed_fractions), compiled(limit_forces)


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


@given(st.lists(st.floats(0.0, 100.0), min_size=1, max_size=8), st.floats(1.0, 5000.0))
@settings(max_examples=examples(30), deadline=None)
def test_compiled_limits_are_the_servers(demands: list[float], k: float) -> None:
    change, n = np.array(demands), len(demands)
    C = np.full((n, n), 0.5 / k) + 0.5 / k * np.eye(n)
    taken = (change, np.full(n, k), C, 1.0)
    assert FAST_FRACTIONS(*taken) == pytest.approx(allowed_fractions(*taken), rel=1e-12)
    whole = (change, np.full(n, np.inf))
    assert FAST_BOUNDED(*whole) == pytest.approx(limit_forces(*whole), rel=1e-12)


def test_with_neither_lag_nor_anticipation_the_room_swings(monkeypatch: pytest.MonkeyPatch) -> None:
    """The check of the campaign can fail: without both it does, with the layer and without."""
    trials = [draw(0, i) for i in range(300)]
    assert play(trials, OURS, seconds=8.0).unstable.sum() == 0
    assert play(trials, OURS.without_passivity, seconds=8.0).unstable.sum() == 0

    def none(trial: Trial, variant: Variant) -> tuple[float, Coupling]:
        return 0.0, lag_of(trial, variant)[1]._replace(fraction=-1.0)

    monkeypatch.setattr(simulation, "lag_of", none)
    assert play(trials, OURS, seconds=8.0).unstable.sum() > 0


@pytest.mark.parametrize("row", [*ROWS, WEAK_OFF], ids=lambda row: row.name)
def test_the_rows_of_the_campaign_hold_on_a_few_of_their_rooms(row: Row) -> None:
    verdicts = play([row.draw(0, i) for i in range(24)], row.variant, seconds=row.seconds)
    assert verdicts.unstable.sum() == 0
    assert verdicts.step.max() <= STEP + 1e-9


def test_the_experiment_holds_and_writes_its_outcome(tmp_path: Path) -> None:
    check_quick_run("hands", tmp_path)
