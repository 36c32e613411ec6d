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
from cohaptic_ops.monitoring.metrics import RoomHealth, TimeCounts
from cohaptic_ops.monitoring.overview import Status, overview, quantile, since_then
from tests.ops.monitoring.some import cluster, health, room, ticking, times, user


def of(known: Known, now: float = 1.0) -> Status:
    return Status.model_validate_json(json.dumps(status(known, now)))


def drawn(told: Status, width: int, before: Status | None = None) -> list[str]:
    file = io.StringIO()
    Console(file=file, width=width).print(overview(told, before, width))
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


def test_a_sentence_tells_for_whom_the_lag_is() -> None:
    def told(lag: float, *by: str | None) -> list[str]:
        users = tuple(user(i, f"user{i}", sets_lag=why) for i, why in enumerate(by, start=1))
        lines = drawn(of(ticking(room(users=users, lag=lag))), 120)
        return [line for line in lines if "lag of" in line]

    assert told(0.24, None, "damping") == [
        "main: lag of 240 ms, since the device of user2 may damp least"
    ]
    assert told(0.5, "delay", None, "delay") == [
        "main: lag of 500 ms, since the loops of user1 and user3 are slowest"
    ]
    assert told(0.24, *["damping"] * 6) == [
        "main: lag of 240 ms, since the devices of user1, user2, user3 and 3 more may damp least"
    ]
    assert told(0.03, None, None) == []
    assert told(0.001, "damping") == []


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
    told = drawn(of(ticking(room(users=users, models=0.5, models_off=off))), 150)
    lines = [line for line in told if "models" in line]
    assert lines == ([f"main: models of the hands answer to 50 %, since {why}"] if why else [])


def test_a_sentence_tells_whose_link_wavers_and_what_that_costs() -> None:
    def told(*wavers: float) -> list[str]:
        users = tuple(user(i, f"user{i}", wavers=w) for i, w in enumerate(wavers, start=1))
        return [line for line in drawn(of(ticking(room(users=users))), 120) if "waver" in line]

    assert told(0.004, 0.0121) == [
        "main: the link of user2 wavers; what comes of it is felt up to 12 ms later"
    ]
    both = "main: the links of user1 and user2 waver; what comes of it is felt up to 50 ms later"
    assert told(0.02, 0.05) == [both]
    assert told(0.004) == []


def test_brackets_in_a_name_are_brackets() -> None:
    text = "\n".join(drawn(of(ticking(room(users=(user(name="[red]ada[/]"),)))), 80))
    assert "[red]ada[/]" in text


def test_what_is_counted_is_counted_since_the_earlier_reading() -> None:
    before = of(ticking(room(ticks=1000, missed=900, cost=times(*[0.2] * 50))))
    told = of(ticking(room(ticks=1100, missed=900, cost=times(*[0.2] * 50, *[0.004] * 9))))
    row = next(line for line in drawn(told, 80, before) if line.startswith("main"))
    assert "0.0 %" in row
    assert "4.0" in row
    # Of a process that was started again nothing is taken off.
    assert since_then(before.rooms[0].metrics, told.rooms[0].metrics) == before.rooms[0].metrics


def test_a_quantile_lies_in_the_bucket_of_its_value() -> None:
    counted = times(*[0.0024] * 99, 0.08)
    half = quantile(counted, 0.5)
    assert half is not None
    assert 0.002 <= half <= 0.003
    last = quantile(counted, 1.0)
    assert last is not None
    assert 0.05 <= last <= 0.1
    assert quantile(times(), 0.5) is None
    assert quantile(times(7.0), 0.5) == 0.25  # no better is known
    assert TimeCounts.model_validate(counted.model_dump()) == counted


def test_why_a_server_is_not_ready_is_told() -> None:
    assert "has not said anything" in drawn(of(Known()), 80)[0]


@pytest.mark.parametrize("width", [80, 120])
def test_a_machine_of_a_cluster_says_who_answers_and_what_it_has(width: int) -> None:
    known = ticking(BUSY)
    known.take(health(RoomHealth(name="main", state="open"), cluster=cluster()), 1.0)
    told = " ".join(line.strip() for line in drawn(of(known), width))
    assert "10.0.0.2:8764: 3 of 3 witnesses answer, 4 rooms here" in told
    assert "decides where rooms are wanted" in told
    assert max(map(len, drawn(of(known), width))) <= width
