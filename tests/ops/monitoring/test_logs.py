"""Lines of the log for machines: one object each, whatever is said and by whom."""

from __future__ import annotations

import io
import json
import logging
import sys
from datetime import datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.clock import SystemClock
from cohaptic_server.guard.limits import Budget, Limits
from cohaptic_server.logs import JsonLines, LogFormat, LogStyle, set_up_log
from cohaptic_server.room.peer import LogLine
from cohaptic_server.shell.limiter import ConnectionLimiter


def record(text: str, **extra: str) -> logging.LogRecord:
    made = logging.LogRecord("cohaptic.server", logging.INFO, "", 0, "%s", (text,), None)
    made.__dict__.update(extra)
    return made


@given(st.text(), st.text(min_size=1), st.text(max_size=9))
def test_a_line_is_one_object_in_ascii_whatever_a_stranger_says(
    text: str, user: str, event: str
) -> None:
    line = JsonLines("liver").format(record(text, user=user, event=event))
    assert line.isascii()
    assert line.isprintable()
    reported = json.loads(line)
    assert (reported["message"], reported["user"], reported["room"]) == (text, user, "liver")
    assert reported["event"] == (event or "message")
    assert datetime.fromisoformat(reported["time"]).tzinfo is not None


def test_a_traceback_is_within_its_line() -> None:
    try:
        raise ValueError("wrong")
    except ValueError:
        made = record("ended")
        made.exc_info = sys.exc_info()
    line = JsonLines().format(made)
    assert "\n" not in line
    assert "ValueError: wrong" in json.loads(line)["traceback"]


@pytest.mark.parametrize("style", list(LogFormat))
def test_lines_about_one_address_stay_bounded_in_both_formats(
    style: LogFormat, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = io.StringIO()
    monkeypatch.setattr(sys, "stderr", file)
    root = logging.getLogger()
    before, level = root.handlers[:], root.level
    root.handlers[:] = []
    try:
        set_up_log(LogStyle(logging.INFO, style), "liver")
        limiter = ConnectionLimiter(Limits(lines=Budget(1e-3, 3)), SystemClock())
        for _ in range(10):
            limiter.write(LogLine("ada joined", source="here", event="joined", user="ada"))
        limiter.report(after=0.0)
    finally:
        root.handlers[:] = before
        root.setLevel(level)
    lines = file.getvalue().splitlines()
    assert len(lines) == 4
    if style is LogFormat.JSON:
        reported = [json.loads(line) for line in lines]
        assert [line["event"] for line in reported] == ["joined"] * 3 + ["lines_left_out"]
        assert {line["source"] for line in reported} == {"here"}
        assert reported[0]["user"] == "ada"
        assert reported[0]["room"] == "liver"
    else:
        assert "[liver] ada joined" in lines[0]
        assert "7 lines about here were left out" in lines[3]
