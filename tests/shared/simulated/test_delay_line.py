from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from cohaptic.errors import LinkOverflow, SettingError
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
def test_the_same_seed_gives_the_same_delays(setting: LinkSettings, gaps: list[float]) -> None:
    assert send(setting, gaps) == send(setting, gaps)


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


def test_jitter_and_tail_have_the_same_distribution_with_and_without_memory() -> None:
    """A memory says how long an extra delay lasts, and not how large it is."""
    free = delays(LinkSettings(jitter=0.1, tail=0.02, seed=1))
    kept = delays(LinkSettings(jitter=0.1, tail=0.02, seed=2, memory=0.3))
    shares = [0.1, 0.5, 0.9]
    assert np.quantile(kept, shares) == pytest.approx(np.quantile(free, shares), rel=0.08)
    assert free.mean() == pytest.approx(0.05 + 0.02, rel=0.05)


def test_with_a_memory_the_next_delay_is_like_the_last() -> None:
    """Far below the gap the delays are independent, far above they hardly change."""
    line = LinkSettings(jitter=1.0, memory=10.0, seed=4)
    near, far = delays(line, gap=1.0), delays(line, gap=60.0)
    assert np.corrcoef(near[:-1], near[1:])[0, 1] == pytest.approx(0.9, abs=0.03)
    assert abs(np.corrcoef(far[:-1], far[1:])[0, 1]) < 0.05


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


def test_a_line_that_was_idle_for_a_day_goes_on_at_once() -> None:
    line: DelayLine[int] = DelayLine(LinkSettings(stall=0.01, stalls=2.0))
    line.push(0, 0.0)
    assert line.push(1, 86_400.0) == pytest.approx(86_400.0, abs=0.01)


def test_other_seeds_give_other_delays() -> None:
    first, second = (send(LinkSettings(0.1, 0.05, seed), [0.1] * 5) for seed in (1, 2))
    assert first != second


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


@pytest.mark.parametrize("bad", [-0.001, 5.1, float("nan"), float("inf")])
def test_absurd_settings_are_refused(bad: float) -> None:
    with pytest.raises(SettingError, match="delay of a link"):
        LinkSettings(delay=bad)
    with pytest.raises(SettingError, match="jitter of a link"):
        LinkSettings(jitter=bad)
    with pytest.raises(SettingError, match="stalls of a link"):
        LinkSettings(stalls=bad)
