"""The card of the own hand says whose fault it is that a force came late."""

from __future__ import annotations

import os
import re
import signal
import threading
from collections.abc import Iterator

import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import Visitor

pytestmark = pytest.mark.live

STILL = 0.4  # s, far more than any machine of a test is late by itself
_TICKS = re.compile(r"the server is up to (\d+)\sms late")
_STALL = re.compile(r"this browser is up to (\d+)\sms late")


@pytest.fixture
def ann(visitors: Open, room: Room) -> Iterator[Visitor]:
    """Who presses."""
    ann = visitors()
    ann.visit(room.address)
    ann.take_part("ann")
    ann.press()
    ann.until(lambda: ann.force > 0.5, "a force")
    yield ann
    ann.release()


def said(visitor: Visitor, words: re.Pattern[str]) -> float:
    """The time that the card names [s]; 0 where it names none."""
    card = visitor.page.locator(".card[data-user] .card-people").first.inner_text()
    found = words.search(card)
    return 1e-3 * int(found[1]) if found else 0.0


def test_a_server_that_stood_still_for_a_moment_is_named(ann: Visitor, room: Room) -> None:
    os.kill(room.pid, signal.SIGSTOP)
    threading.Event().wait(STILL)
    os.kill(room.pid, signal.SIGCONT)
    ann.until(lambda: said(ann, _TICKS) > STILL - 0.05, "word of the server's ticks")
    # As long as a loop's delay counts, and no longer.
    ann.until(lambda: said(ann, _TICKS) < STILL - 0.05, "the word to go")


def test_a_browser_that_stopped_the_hand_is_named(ann: Visitor) -> None:
    ann.page.workers[0].evaluate(
        "ms => { const end = performance.now() + ms; while (performance.now() < end); }",
        1e3 * STILL,
    )
    ann.until(lambda: said(ann, _STALL) > STILL - 0.05, "word of the stall")
    ann.until(lambda: said(ann, _STALL) < STILL - 0.05, "the word to go")
