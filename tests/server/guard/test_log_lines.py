from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.guard.limits import Budget
from cohaptic_server.guard.sources import LogLines

BUDGET = Budget(2.0, 5.0)


@given(st.lists(st.tuples(st.sampled_from("ab"), st.floats(0.0, 3.0)), max_size=100))
def test_every_line_is_written_or_counted(lines: list[tuple[str, float]]) -> None:
    kept, now, written, counted = LogLines(BUDGET), 0.0, 0, 0
    for source, pause in lines:
        now += pause
        written += kept.pass_on(source, now)
        counted += sum(count for _, count in kept.left_out(now, after=4.0))
    counted += sum(count for _, count in kept.left_out(now))
    assert written + counted == len(lines)
    assert written <= 2 * (BUDGET.burst + BUDGET.rate * now) + 1
    assert kept.left_out(now) == []


def test_a_flood_about_one_silences_no_other() -> None:
    lines = LogLines(BUDGET)
    assert sum(lines.pass_on("a", 0.0) for _ in range(43_685)) == 5
    assert lines.pass_on("b", 0.0)
    assert lines.left_out(3.0, after=10.0) == []
    assert lines.left_out(10.0, after=10.0) == [("a", 43_680)]


def test_the_addresses_are_bounded() -> None:
    lines = LogLines(BUDGET)
    for number in range(10_000):
        for _ in range(6):
            lines.pass_on(f"{number}", 0.0)
    assert len(lines.left_out(0.0)) <= 1024
