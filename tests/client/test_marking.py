"""Marks in a recording: of a hand in a script, of `cohaptic mark`, and of lines."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError
from cohaptic.sessions.entries import Rows
from cohaptic.sessions.reader import Outline, read_entries
from cohaptic.status.row import ROW
from cohaptic_client import joined
from cohaptic_client.mark_cli import mark
from cohaptic_client.marking import mark_of_line
from cohaptic_server import serve

CLOCK = SystemClock()


def run(*arguments: str, given: str | None = None) -> None:
    app = typer.Typer()
    app.command()(mark)
    result = CliRunner().invoke(app, list(arguments), input=given)
    if isinstance(result.exception, Exception):
        raise result.exception


def at_once(call: Callable[[], None]) -> tuple[float, float]:
    """The times before and after a call [s]."""
    before = CLOCK.now()
    call()
    return before, CLOCK.now()


def marks(path: Path) -> list[tuple[str, dict[str, object], int | None]]:
    return [(m.text, dict(m.fields), m.by) for m in Outline.of(path).marks]


@pytest.mark.live
def test_a_hand_in_a_script_is_recorded_with_every_period_and_its_marks(tmp_path: Path) -> None:
    path, calls = tmp_path / "x.mcap", list[tuple[float, float]]()
    with serve("balloon", port=0, record=str(path)) as room, joined(room.url, name="ann") as hand:
        samples = hand.samples()
        next(row for row in samples if hand.recorded)
        began = room.room.members[hand.user].joined
        calls.append(at_once(lambda: hand.mark("stimulus on", trial=3, side="left")))
        rows = [next(samples) for _ in range(1000)]
        calls.append(at_once(lambda: hand.mark("stimulus off")))
        assert "recorded" in [event.kind for event in hand.events.new()]
    found = [entry for entry in read_entries(path) if isinstance(entry, Rows)]
    times = [
        ROW.unpack_from(e.block, i)[0] for e in found for i in range(0, len(e.block), ROW.size)
    ]
    kept = {round(t, 7) for t in times}
    # What came before the first patch after the news is not sent; of the others none is missing.
    assert sum(round(row.t, 7) in kept for row in rows[200:]) == 800
    assert marks(path) == [
        ("stimulus on", {"trial": 3, "side": "left"}, 1), ("stimulus off", {}, 1),
    ]  # fmt: skip
    on, off = Outline.of(path).marks
    assert began < on.t < off.t
    # As far apart as the calls, to the errors that they say.
    assert on.error is not None
    assert off.error is not None
    error = on.error + off.error + 1e-6
    (first, after_first), (second, after_second) = calls
    assert second - after_first - error <= off.t - on.t <= after_second - first + error


@pytest.mark.live
def test_a_mark_has_its_moment_through_a_slow_link_to_the_error_that_it_says(
    tmp_path: Path,
) -> None:
    """Server and hand have the clock of one machine here, which neither of them knows."""
    path, calls, to_wall = tmp_path / "x.mcap", list[tuple[float, float]](), CLOCK.to_wall()
    with (
        serve("balloon", port=0, record=str(path)) as room,
        joined(room.url, name="ann", network="delay=80") as hand,
    ):
        samples = hand.samples()
        next(row for row in samples if hand.recorded)
        for _ in range(3):
            for _ in range(300):
                next(samples)
            calls.append(at_once(lambda: hand.mark("stimulus on")))
        for _ in range(500):
            next(samples)
    outline = Outline.of(path)
    assert len(outline.marks) == 3
    for found, (before, after) in zip(outline.marks, calls, strict=True):
        assert found.error is not None
        called = found.t + outline.info.to_wall - to_wall
        assert before - found.error <= called <= after + found.error


@pytest.mark.live
def test_marks_that_are_set_just_before_a_hand_leaves_are_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    with serve("balloon", port=0, record=str(path)) as room:
        with joined(room.url, name="ann") as hand:
            next(row for row in hand.samples() if hand.recorded)
            for k in range(8):
                hand.mark("last", k=k)
    assert marks(path) == [("last", {"k": k}, 1) for k in range(8)]


@pytest.mark.live
def test_the_command_sets_a_mark_or_many(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    with serve("balloon", port=0, record=str(path)) as room:
        run("begin", room.url, "--set", "trial=3", "--set", "side=left", "--set", "valid=true")
        run("--lines", room.url, given='first\n\n{"text": "second", "n": 2.5}\n')
        with pytest.raises(SettingError, match="text of a mark"):
            run("", room.url, "--lines", given="x" * 201)
        with pytest.raises(SettingError, match="fields"):
            run("begin", room.url, *(f"--set=a{k}={k}" for k in range(17)))
    assert marks(path) == [
        ("begin", {"trial": 3, "side": "left", "valid": True}, None),
        ("first", {}, None),
        ("second", {"n": 2.5}, None),
    ]


@pytest.mark.live
def test_a_mark_where_nothing_records_is_an_error() -> None:
    with serve("balloon", port=0) as room:
        with pytest.raises(SettingError, match="serve --record"):
            run("begin", room.url)
        with joined(room.url, name="ann") as hand:
            assert not hand.recorded
            with pytest.raises(SettingError, match="serve --record"):
                hand.mark("begin")


@pytest.mark.parametrize(
    "arguments", [[""], ["begin", "--lines"], ["begin", "--lines", "--lsl"], ["x", "--set=y"]]
)
def test_options_that_contradict_each_other_are_an_error(arguments: list[str]) -> None:
    text, *options = arguments
    with pytest.raises(SettingError):
        run(text, "ws://127.0.0.1:1", *options)


@pytest.mark.parametrize(
    ("line", "text", "fields"),
    [
        ("begin", "begin", {}),
        ('{"text": "begin", "trial": 3}', "begin", {"trial": 3}),
        ('["begin"]', '["begin"]', {}),
        ("3", "3", {}),
    ],
)
def test_a_line_is_text_or_an_object(line: str, text: str, fields: dict[str, object]) -> None:
    found = mark_of_line(line)
    assert (found.text, found.fields) == (text, fields)


def test_an_object_without_a_text_is_no_mark() -> None:
    with pytest.raises(SettingError, match="text of a mark"):
        mark_of_line('{"trial": 3}')


@pytest.mark.live
def test_many_marks_leave_one_after_the_other_and_cost_nobody_the_hand(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    with serve("balloon", port=0, record=str(path)) as room:
        run("--lines", room.url, given="".join(f"{k}\n" for k in range(100)))
    with pytest.raises(SettingError, match="at most 64 that wait"):
        _mark_without_end(tmp_path)
    # All lines came at one moment, and that is the time of each, to the jitter of its way.
    texts = {mark.text for mark in Outline.of(path).marks}
    assert texts == {str(k) for k in range(100)}


def _mark_without_end(folder: Path) -> None:
    with serve("balloon", port=0, record=str(folder)) as room, joined(room.url, name="ann") as hand:
        next(row for row in hand.samples() if hand.recorded)
        for k in range(1000):
            hand.mark(str(k))
