"""Forces of the golden sessions, and the tool that compares two trees by them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import golden
from cohaptic.compiled import use
from cohaptic.control.law import Law
from cohaptic.protocol.messages import FixedGains
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from golden_sessions import LENGTH, SESSIONS, Trace, draw, play
from tests.give_up import give_up

# N. Processors and libraries round differently: with the BLAS and numpy of a processor without AVX
# most sessions had other bits, and none of these forces another fifth digit.
TOLERANCE = 1e-4
SLOW = ("rubber balloon", "rubber block", "served ring")  # they factor or solve in every tick
SEEDS = [pytest.param(seed, id=name) for seed, (name, _, _) in enumerate(SESSIONS)]


def kept(seed: int) -> list[np.ndarray]:
    """Forces of each user that were recorded."""
    read = json.loads(golden.KEPT.read_text(encoding="utf-8"))
    return [np.array(user) for user in read[SESSIONS[seed][0]]]


def off_by(seed: int, traces: list[Trace]) -> float:
    """Largest difference from the recorded forces [N]."""
    pairs = zip(traces, kept(seed), strict=True)
    return max(float(np.abs(np.array(golden.samples(t)) - forces).max()) for t, forces in pairs)


@pytest.mark.parametrize("seed", SEEDS)
def test_forces_are_those_that_were_recorded(seed: int) -> None:
    """If a change was meant to move forces, `python tools/golden.py keep` records them anew."""
    if SESSIONS[seed][0] in SLOW and not use("kernels"):
        give_up("as plain Python it takes minutes")
    assert off_by(seed, play(seed)) < TOLERANCE


def test_a_body_that_is_softer_by_a_thousandth_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    softer = BalloonSettings(subdivisions=2, contact_radius=0.03, mu_h=249.75)
    monkeypatch.setattr("golden_sessions.SESSIONS", (("balloon", 60.0, lambda: Balloon(softer)),))
    assert off_by(0, play(0)) > TOLERANCE


def test_the_sessions_have_everything_that_moves_a_force() -> None:
    visits = [visit for seed in range(len(SESSIONS)) for visit in draw(seed)]
    assert {visit.law for visit in visits} == set(Law)
    assert {type(visit.then) for visit in visits} == {type(None), Law, FixedGains}
    assert {visit.geometry for visit in visits} == {"plane", "sphere", "mesh"}
    for values in (
        {visit.friction > 0.0 for visit in visits},
        {visit.jitter > 0.0 for visit in visits},
        {visit.delay > 0.0 for visit in visits},
        {visit.damping > 0.0 for visit in visits},
        {visit.script.drag != 0.0 for visit in visits},
        {visit.script.rhythm is None for visit in visits},
        {visit.leaves < LENGTH for visit in visits},
        {visit.silent[1] > visit.silent[0] for visit in visits},
        {visit.comes > 0.0 for visit in visits},
    ):
        assert values == {True, False}


@pytest.fixture
def trace() -> Trace:
    times = np.arange(100.0)
    return Trace(np.stack([times, 0.5 * times, -times], axis=1), 0.1 * times, b"patches")


def two(folder: Path, one: list[Trace], other: list[Trace]) -> list[str]:
    """What is said to differ between two recordings."""
    for name, traces in (("before", one), ("after", other)):
        (folder / name).mkdir()
        golden.write(folder / name / "ring.npz", traces)
    return golden.differences(folder / "before", folder / "after")


def test_one_bit_is_a_difference(trace: Trace, tmp_path: Path) -> None:
    force = trace.force.copy()
    force[42, 1] = math.nextafter(force[42, 1], math.inf)
    (line,) = two(tmp_path, [trace, trace], [trace, replace(trace, force=force)])
    assert line.startswith("ring, force of user 1: differs from 0.042 s on, by 3.6e-15 N")
