"""The page of `cohaptic demo`, on loopback: everything that the tour shows is allowed there."""

from __future__ import annotations

import re
import signal
import subprocess
import sys

import pytest

from tests.browser.conftest import Open

pytestmark = pytest.mark.live

_PAGE = re.compile(r"page (http://127\.0\.0\.1:\d+/)\n")
_LOOP = re.compile(r"(\d+)\sms there and back")
DELAY_MS = 80  # each way, of a demonstration that was asked for none


def test_the_demos_page_shows_both_hands_and_may_do_everything(visitors: Open) -> None:
    demo = subprocess.Popen(
        [sys.executable, "-m", "cohaptic", "demo", "--duration", "600", "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert demo.stdout is not None
    with demo:
        try:
            # On a busy machine a line before it says at which rate the demo runs, and why.
            said = iter(demo.stdout.readline, "")
            address = next(filter(None, (re.fullmatch(_PAGE, line) for line in said)))
            ann = visitors()
            ann.visit(address[1])
            ann.until(
                lambda: all(ann.force_of(name) > 0.5 for name in ("left", "right")),
                "both of them to press",
            )
            # The delay that the clients put there, by what went there and back.
            loops: list[str] = []

            def measured() -> bool:
                cards = ann.page.locator(".card[data-user] .card-people").all_inner_texts()
                loops[:] = [ms for words in cards for ms in _LOOP.findall(words)]
                return len(loops) == len(cards) == 2

            ann.until(measured, "both loops to be measured")
            assert all(int(ms) >= 2 * DELAY_MS for ms in loops)
            # What a server has to allow: sliders of delay, and the paper's own rule.
            assert ann.page.locator(".card .latency").first.is_visible()
            assert ann.page.locator("input[value=paper]").is_enabled()
            ann.away = True
            # Whoever looked, it ends as always when it is told to.
            demo.send_signal(signal.SIGINT)
            assert "what they felt of each other" in demo.stdout.read()
        finally:
            demo.kill()  # what it started ends with it
