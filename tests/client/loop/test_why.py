"""`cohaptic why` on twelve staged cases: which rule acted, and by how much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cohaptic.control.hand_model import USUAL_HAND
from cohaptic.control.tick_ledger import TickLedger
from cohaptic.protocol.partners import Partner, Partners
from cohaptic.protocol.patch import Patch
from cohaptic.recording.why import ENTRIES, Why, why
from cohaptic.vec import Vec3
from cohaptic_client.loop.passivity import Passivity
from tests.client.loop.staged import DEPTH, Stage, honest
from tests.client.plane import STIFFNESS


def last(stage: Stage) -> Why:
    """The answer for the last period, whose entries are the force."""
    found = why(stage.columns(), stage.length)
    assert sum(entry.newtons for entry in found.entries) == pytest.approx(found.force, abs=1e-9)
    return found


def entry(found: Why, name: str) -> float:
    return next(each.newtons for each in found.entries if each.name == name)


def test_a_models_answer() -> None:
    stage = Stage()
    coupled = 0.5 / STIFFNESS
    other = Partner(2, USUAL_HAND, 0.006, 0.0, 0.8, 10.0, 1.0 / STIFFNESS, (coupled,))

    def beside(patch: Patch, force: Vec3) -> Patch:
        x_free = (0.0, 0.0, -coupled * 0.8)  # the other presses the surface away
        partners = Partners(1.0, 10.0, USUAL_HAND, (other,))
        return replace(honest(patch, force), partners=partners, x_free=x_free)

    stage.server = beside
    stage.press()
    before = entry(last(stage), "models")
    stage.go((0.0, 0.0, -DEPTH - 0.003), 0.03)
    found = last(stage)
    # The other is pushed away by the press, and the surface comes back at once.
    assert entry(found, "models") != pytest.approx(before, abs=0.01)
    assert f"{abs(entry(found, 'models')):.2f} N by models" in found.sentence


def test_passivity() -> None:
    stage = Stage()
    stage.press()
    stage.state = replace(stage.state, passivity=Passivity(0.05, 8.0, stage.state.passivity.stored))
    stage.go((0.0, 0.0, -DEPTH - 0.002), 0.02)
    found = last(stage)
    assert entry(found, "damping") == pytest.approx(0.8, rel=0.05)  # 8 N s/m at 0.1 m/s
    assert "by damping" in found.sentence


def test_what_a_silent_server_did_last_is_not_told_as_if_it_were_now() -> None:
    stage = Stage()
    cut = TickLedger(by_lag=-0.5, gain_cut=250.0)
    stage.server = lambda patch, force: replace(honest(patch, force), ledger=cut)
    stage.press()
    assert "by lag" in last(stage).sentence
    stage.server = None
    stage.rest(0.3)
    assert "by lag" not in last(stage).sentence
    assert "less, since" not in last(stage).sentence


def test_every_row_of_a_recording_adds_up() -> None:
    stage = Stage()
    stage.press()
    stage.go((0.0, 0.0, 0.004), 0.02)
    columns = stage.columns()
    size = np.sqrt(columns["fx"] ** 2 + columns["fy"] ** 2 + columns["fz"] ** 2)
    assert sum(columns[name] for name in ENTRIES) == pytest.approx(size, abs=1e-9)
