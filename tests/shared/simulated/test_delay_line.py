from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import LinkOverflow, SettingError
from cohaptic.simulated.delay_line import CAPACITY, DelayLine, LinkSettings

settings = st.builds(
    LinkSettings, delay=st.floats(0.0, 1.0), jitter=st.floats(0.0, 0.5), seed=st.integers(0, 99)
)
gaps = st.lists(st.floats(0.0, 0.1), min_size=1, max_size=50)


def send(setting: LinkSettings, gaps: list[float]) -> list[tuple[float, float]]:
    """When each message was sent and due."""
    line: DelayLine[int] = DelayLine(setting)
    now, times = 0.0, list[tuple[float, float]]()
    for i, gap in enumerate(gaps):
        now += gap
        times.append((now, line.push(i, now)))
    return times


@given(settings, gaps)
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


@given(settings, gaps)
def test_the_same_seed_gives_the_same_delays(setting: LinkSettings, gaps: list[float]) -> None:
    assert send(setting, gaps) == send(setting, gaps)


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
