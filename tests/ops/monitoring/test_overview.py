"""The terminal's view: fits, and draws nothing that a stranger wrote."""

from __future__ import annotations

import io
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from cohaptic_ops.monitoring.admin_process import status
from cohaptic_ops.monitoring.known import Known
from cohaptic_ops.monitoring.metrics import RoomHealth
from cohaptic_ops.monitoring.overview import Status, overview
from tests.ops.monitoring.some import health, room, ticking, times, user


def of(known: Known, now: float = 1.0) -> Status:
    return Status.model_validate_json(json.dumps(status(known, now)))


def drawn(reported: Status, width: int, before: Status | None = None) -> list[str]:
    file = io.StringIO()
    Console(file=file, width=width).print(overview(reported, before, width))
    return file.getvalue().splitlines()


BUSY = room(
    "a-room-with-a-long-name",
    123456,
    users=tuple(user(seat, f"{seat} who has a very long name indeed") for seat in range(1, 17)),
    max_users=16, missed=20000, watchers=1000, lag=1.999, margin=54.25, memory=2**31,
    cost=times(0.2, 0.2, 0.3), lateness=times(0.24), limited={"depth": 99999, "speed": 9999},
)  # fmt: skip


@pytest.mark.parametrize("width", [80, 120])
def test_every_column_can_be_read_at_its_width(width: int) -> None:
    lines = drawn(of(ticking(BUSY)), width)
    assert max(map(len, lines)) <= width
    heads = next(line for line in lines if line.startswith("room"))
    for head in ("state", "users", "tick ms", "p99", "late", "missed", "lag ms", "margin"):
        assert head in heads
    row = next(line for line in lines if line.startswith("a-room"))
    for cell in ("open", "16/16", "250.0", "16.2 %", "1999", "54.25"):
        assert cell in row, row


@given(st.text(min_size=1, max_size=60), st.text(max_size=60))
def test_what_a_stranger_wrote_is_one_printable_line(name: str, problem: str) -> None:
    known = ticking(room(users=(user(name=name),)))
    plain = len(drawn(of(ticking(room(users=(user(),)))), 200))
    assert len(drawn(of(known), 200)) == plain
    rooms = (
        RoomHealth(name="main", state="open"),
        RoomHealth(name="other", state="broken", problem=problem, restarts=1),
    )
    known.take(health(*rooms), 1.0)
    assert all(line.isprintable() for line in drawn(of(known), 200))


PRESSED = "pressed by a law or a device that has none"


@pytest.mark.parametrize(
    ("off", "by", "why"),
    [
        ("hand", "b", f"user1 {PRESSED}"),
        ("hand", "abc", f"user0, user1 and user2 {PRESSED}"),
        ("hand", "abcd", f"user0, user1, user2 and 1 more {PRESSED}"),
        ("hand", "", f"a user who has left {PRESSED}"),
        ("link", "b", "user1 pressed over a link whose delay jumps again and again"),
        ("number", "", "more than 8 hands pressed"),
        ("object", "", "the object or a contact on it was no linear spring"),
        ("", "", ""),
    ],
)
def test_a_sentence_tells_why_there_are_no_models(off: str, by: str, why: str) -> None:
    users = tuple(
        user(i + 1, f"user{i}", forbids_models=letter in by) for i, letter in enumerate("abcd")
    )
    reported = drawn(of(ticking(room(users=users, models=0.5, models_off=off))), 150)
    lines = [line for line in reported if "models" in line]
    assert lines == ([f"main: models of the hands answer to 50 %, since {why}"] if why else [])


def test_brackets_in_a_name_are_brackets() -> None:
    text = "\n".join(drawn(of(ticking(room(users=(user(name="[red]ada[/]"),)))), 80))
    assert "[red]ada[/]" in text
