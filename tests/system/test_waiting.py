"""A hand that waits before a full room, as `cohaptic touch --wait-seat` does."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from cohaptic.clock import SystemClock
from cohaptic_tools.demo.processes import Process
from tests.patience import PATIENCE

pytestmark = pytest.mark.live
CLOCK = SystemClock()


def until(condition: Callable[[], bool]) -> None:
    deadline = CLOCK.now() + PATIENCE
    while not condition():
        assert CLOCK.now() < deadline
        threading.Event().wait(0.05)


def state(hand: Process) -> str:
    return str(json.loads(hand.line or "{}").get("state"))


def test_hands_wait_are_told_their_places_and_come_in_one_after_the_other(tmp_path: Path) -> None:
    server = Process("serve", "--port", "0", "--max-users", "1", log=tmp_path / "server.log")
    url = server.first_line().removeprefix("listening ")

    def touch(name: str, *options: str) -> Process:
        return Process(
            "touch", url, "--name", name, "--geometry", "plane", "--json-lines", *options,
            log=tmp_path / f"{name}.log",
        )  # fmt: skip

    hands = {"first": touch("first")}
    try:
        until(lambda: state(hands["first"]) in ("free", "touching"))
        refused = touch("refused")
        until(lambda: not refused.running)
        refused.wait()
        said = (tmp_path / "refused.log").read_text()
        assert "or wait for a place" in said.replace("\n", " ")
        assert "with --wait-seat you wait for a place" in said.replace("\n", " ")
        hands["second"] = touch("second", "--wait-seat")
        until(lambda: state(hands["second"]) == "place 1 of 1")
        hands["third"] = touch("third", "--wait-seat")
        until(lambda: state(hands["third"]) == "place 2 of 2")
        hands.pop("first").wait()
        until(lambda: state(hands["second"]) in ("free", "touching"))
        until(lambda: state(hands["third"]) == "place 1 of 1")
        hands.pop("second").wait()
        until(lambda: state(hands["third"]) in ("free", "touching"))
        assert "place 2 of 2" in (tmp_path / "third.log").read_text()
    finally:
        for hand in hands.values():
            hand.wait()
        server.wait()
    assert "Traceback" not in (tmp_path / "server.log").read_text()
