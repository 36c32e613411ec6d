"""Roughness is that of the network: a delay alone has none, and what is added is found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_experiments.transparency.product import Product, Variant
from cohaptic_experiments.transparency.roughness import (
    changing_offset,
    measure_roughness,
    true_sway,
)
from cohaptic_experiments.transparency.scheme import Arrived
from cohaptic_experiments.transparency.setting import Setting
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats


def sway(late: Floats | float) -> Floats:
    """A sway at 1 Hz, by so much later [s]."""
    t: Floats = PERIOD * np.arange(6000, dtype=np.float64)
    return 2.0 + np.asarray(0.25 * np.sin(2.0 * np.pi * (t - late)))


@given(st.integers(0, 160))
def test_a_constant_delay_is_found_and_does_not_vary(steps: int) -> None:
    offsets, value = changing_offset(sway(0.005 * steps), sway(0.0))
    assert offsets == pytest.approx(0.005 * steps, abs=0.006)
    assert value < 0.01


def test_a_delay_that_changes_is_told_from_an_error_of_the_force() -> None:
    wavers = 0.2 + 0.05 * np.sin(2.0 * np.pi * 0.3 * PERIOD * np.arange(6000))
    offsets, value = changing_offset(sway(np.asarray(wavers)), sway(0.0))
    assert float(np.ptp(offsets)) == pytest.approx(0.1, abs=0.04)
    assert value < 0.02
    _, value = changing_offset(1.5 * sway(0.2), sway(0.0))
    assert value > 0.5


def test_jitter_and_late_ticks_are_felt_as_a_delay_alone(balloon: Balloon) -> None:
    """The claim of science 3.16, through the real room, frames and loops (issue figures)."""
    setting = Setting(balloon, link=LinkSettings(0.01, 0.01), late_ticks=0.25)
    (found,) = measure_roughness(
        setting, lambda: setting.product(Variant(models=True)), true_sway(setting)
    )
    assert found.fast <= 0.005
    assert found.path <= 1.25
    assert found.swing == pytest.approx(found.true_swing, rel=0.1)
    assert found.at_rest <= 0.02
    # Without models, whose force moves with the others' wishes, it is later.
    assert 0.02 <= found.late <= 0.15


class Counted:
    """The product, which remembers the times of its ticks."""

    def __init__(self, product: Product) -> None:
        self._product, self.ticks, self.period = product, list[float](), product.period
        self.client = product.client

    def server(
        self, now: float, inboxes: Mapping[int, Sequence[Arrived[bytes]]]
    ) -> Mapping[int, bytes]:
        self.ticks.append(now)
        return self._product.server(now, inboxes)


def test_late_ticks_come_as_late_as_is_asked(balloon: Balloon) -> None:
    """The server's ticks are counted over the time in which they came."""
    setting = replace(Setting(balloon), late_ticks=0.5)
    counted = Counted(setting.product(Variant(models=True)))
    setting.play(counted, setting.intentions(), 5.0)
    gaps = np.round(np.diff(counted.ticks) / counted.period).astype(int)
    assert set(gaps.tolist()) == {1, 2, 3}
    assert (gaps > 1).mean() == pytest.approx(0.5, abs=0.1)
