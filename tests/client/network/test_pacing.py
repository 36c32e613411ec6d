from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_client.network.timing import GAIN, TARGET_WAIT, Pacer
from tests.examples_of_laws import examples

ROUNDING = 1e-6  # s; clocks of some hours in doubles, times the ticks of a run
SETTLED = 1e-4  # s; a tenth of a haptic period

sim_periods = st.floats(0.005, 0.1)  # s; as a server allows
phases = st.floats(0.0, 1.0)  # of a period


@dataclass
class Line:
    """A client that paces its samples, a link, and a server that ticks; time is the server's.

    Args:
        pacer: Of the client.
        up: Delay of a sample [s].
        down: Delay of a report [s].
        drift: How much faster the client's clock runs.
    """

    pacer: Pacer
    up: float
    down: float
    drift: float = 0.0
    waits: list[float] = field(default_factory=list[float])

    def run(self, ticks: int, period: float) -> list[float]:
        """Waits of the samples that were used, one at most for each tick."""
        samples, reports = deque[tuple[float, float]](), deque[tuple[float, float, float]]()
        rate = 1.0 + self.drift
        for tick in range(1, ticks + 1):
            at = tick * period
            while reports and reports[0][0] <= at:
                _, sent, wait = reports.popleft()
                self.pacer = self.pacer.reported(sent, wait)
            while self.pacer.due / rate <= at:
                samples.append((self.pacer.due / rate + self.up, self.pacer.due))
                self.pacer = self.pacer.sent(self.pacer.due)
            newest = None
            while samples and samples[0][0] <= at:
                newest = samples.popleft()
            if newest is not None:
                arrived, sent = newest
                self.waits.append(at - arrived)
                reports.append((at + self.down, sent, at - arrived))
        return self.waits


@settings(max_examples=examples(40))
@given(sim_periods, phases, st.floats(0.0, 2.0), st.floats(0.0, 2.0))
def test_from_any_phase_and_over_any_delay_the_wait_becomes_the_wanted_one(
    period: float, phase: float, up: float, down: float
) -> None:
    line = Line(Pacer(period, phase * period), up, down)
    target = min(TARGET_WAIT, 0.5 * period)
    # Nothing is reported on the first round trip, no correction arrives before another way up;
    # then 200 corrections of a share each.
    waits = line.run(round((2.0 * up + down) / period) + 300, period)
    assert waits[-100:] == pytest.approx([target] * 100, abs=SETTLED)


@pytest.mark.parametrize("drift", [-2e-4, 0.0, 2e-4])
def test_over_ten_minutes_the_wait_does_not_drift_though_the_clocks_do(drift: float) -> None:
    period = 1.0 / 60.0
    waits = Line(Pacer(period, 0.0), 0.02, 0.02, drift).run(36_000, period)
    # The constant gap is the drift in a period from one correction, and on the way.
    gap = abs(drift) * (period / GAIN + 0.04 + period)
    assert waits[-30_000:] == pytest.approx([TARGET_WAIT] * 30_000, abs=1.1 * gap + ROUNDING)


@given(sim_periods, st.floats(1.0, 2e5), st.lists(st.floats(0.0, 5.0), max_size=50))
def test_without_reports_the_phase_is_kept_and_missed_samples_are_left_out(
    period: float, start: float, late: list[float]
) -> None:
    pacer = Pacer(period, start)
    for wait in late:
        now = pacer.due + wait
        pacer = pacer.sent(now)
        assert now - ROUNDING < pacer.due <= now + period + ROUNDING
        cycles = (pacer.due - start) / period
        assert cycles == pytest.approx(round(cycles), abs=ROUNDING / period)


@given(sim_periods, st.floats(0.0, 1.0))
def test_one_report_moves_the_schedule_by_a_share_of_half_a_period_at_most(
    period: float, wait: float
) -> None:
    moved = Pacer(period, 100.0).reported(99.0, wait).due - 100.0
    assert abs(moved) <= GAIN * 0.5 * period + ROUNDING


@given(sim_periods, st.integers(0, 5))
def test_the_wanted_wait_changes_nothing_whole_periods_more_neither(
    period: float, more: int
) -> None:
    wait = min(TARGET_WAIT, 0.5 * period) + more * period
    assert Pacer(period, 100.0).reported(100.0, wait).due == pytest.approx(100.0, abs=1e-12)


def test_a_sample_that_waits_too_long_is_sent_later_and_one_that_comes_late_earlier() -> None:
    pacer = Pacer(1.0 / 60.0, 100.0)
    sent = 100.0 - 3.0 / 60.0
    assert pacer.reported(sent, 0.005).due > 100.0
    assert pacer.reported(sent, 0.001).due < 100.0
    assert pacer.reported(sent, 0.015).due < 100.0  # nearly a tick: it just missed the one before
