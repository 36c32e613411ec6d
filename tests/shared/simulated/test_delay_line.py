from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from cohaptic.errors import LinkOverflow
from cohaptic.simulated.delay_line import CAPACITY, DelayLine, LinkSettings

settings = st.builds(
    LinkSettings, delay=st.floats(0.0, 1.0), jitter=st.floats(0.0, 0.5), seed=st.integers(0, 99)
)
anything = st.builds(
    LinkSettings,
    delay=st.floats(0.0, 1.0),
    jitter=st.floats(0.0, 0.5),
    seed=st.integers(0, 99),
    tail=st.floats(0.0, 0.1),
    memory=st.floats(0.0, 1.0),
    loss=st.floats(0.0, 0.5),
    stall=st.floats(0.0, 1.0),
    stalls=st.floats(0.0, 2.0),
)
gaps = st.lists(st.floats(0.0, 0.1), min_size=1, max_size=50)


def send(setting: LinkSettings, gaps: list[float]) -> list[tuple[float, float]]:
    """When each message was sent and due."""
    line: DelayLine[int] = DelayLine(setting)
    now, times = 0.0, list[tuple[float, float]]()
    for i, gap in enumerate(gaps):
        now += gap
        times.append((now, line.push(i, now)))
        line.pop_due(now)
    return times


@given(anything, gaps)
def test_a_late_message_delays_those_behind_it_and_order_is_kept(
    setting: LinkSettings, gaps: list[float]
) -> None:
    due = [d for _, d in send(setting, gaps)]
    assert due == sorted(due)


@given(settings, gaps)
def test_no_message_is_early_and_none_later_than_the_worst_before_it(
    setting: LinkSettings, gaps: list[float]
) -> None:
    for sent, due in send(setting, gaps):
        assert sent + setting.delay <= due <= sent + setting.delay + setting.jitter + 1e-12


@given(anything, gaps)
def test_no_message_is_early_whatever_is_lost_and_stalls(
    setting: LinkSettings, gaps: list[float]
) -> None:
    for sent, due in send(setting, gaps):
        assert due >= sent + setting.delay
        assert setting.at_once <= (due == sent)


def delays(setting: LinkSettings, count: int = 6000, gap: float = 1.0) -> NDArray[np.float64]:
    """Delays of many messages, by default so far apart that none waits for another [s]."""
    return np.array([due - sent for sent, due in send(setting, [gap] * count)])


def test_a_lost_message_comes_a_round_trip_later_and_the_share_is_as_asked() -> None:
    late = delays(LinkSettings(delay=0.1, loss=0.2, seed=5))
    assert np.unique(late.round(9)) == pytest.approx([0.1, 0.1 + 0.2 + 0.05])
    assert (late > 0.2).mean() == pytest.approx(0.2, abs=0.02)


def test_in_a_stall_nothing_comes_and_its_end_brings_all_of_it() -> None:
    line = LinkSettings(delay=0.01, stall=0.5, stalls=0.5, seed=6)
    late = delays(line, count=60_000, gap=0.01) - 0.01
    assert 0.0 < late.max() <= 0.5
    # Mean share of the time: 0.25 s of each 2 s and 0.25 s.
    assert (late > 1e-9).mean() == pytest.approx(0.25 / 2.25, rel=0.15)
    # Within a stall each message waits for the same end.
    waits = (late[:-1] > 0.05) & (late[1:] > 0.0)
    assert np.diff(late)[waits] == pytest.approx(-0.01)


def test_messages_come_out_when_due_not_before() -> None:
    line: DelayLine[str] = DelayLine(LinkSettings(delay=0.1))
    line.push("a", 0.0)
    line.push("b", 0.05)
    assert line.next_due() == 0.1
    assert line.pop_due(0.09) == []
    assert line.pop_due(0.1) == ["a"]
    assert line.pop_due(1.0) == ["b"]
    assert line.next_due() is None


def test_a_full_line_says_so() -> None:
    line: DelayLine[int] = DelayLine(LinkSettings(delay=1.0))
    for i in range(CAPACITY):
        line.push(i, 0.0)
    with pytest.raises(LinkOverflow, match=str(CAPACITY)):
        line.push(0, 0.0)
