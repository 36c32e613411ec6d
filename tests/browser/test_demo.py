"""The page of `cohaptic demo`, on loopback: everything that the tour shows is allowed there."""

from __future__ import annotations

import re
import signal
import subprocess
import sys

import pytest

from tests.browser.conftest import Open

pytestmark = pytest.mark.patient


def test_the_demos_page_shows_both_hands_and_may_do_everything(visitors: Open) -> None:
    demo = subprocess.Popen(
        [sys.executable, "-m", "cohaptic", "demo", "--duration", "600", "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert demo.stdout is not None
    with demo:
        try:
            address = re.fullmatch(r"page (http://127\.0\.0\.1:\d+/)\n", demo.stdout.readline())
            assert address is not None
            ann = visitors()
            ann.visit(address[1])
            ann.until(lambda: ann.force_of("left") > 0.5, "left to press")
            assert ann.force_of("right") > 0.5
            # What a server has to allow: sliders of delay, and the paper's own rule.
            assert ann.page.locator(".card .latency").first.is_visible()
            assert ann.page.locator("input[value=paper]").is_enabled()
            ann.away = True
            # Whoever looked, it ends as always when it is told to.
            demo.send_signal(signal.SIGINT)
            assert "what they felt of each other" in demo.stdout.read()
        finally:
            demo.kill()  # what it started ends with it
