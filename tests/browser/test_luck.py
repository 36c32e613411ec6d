"""Bad input and bad luck: the page says what happened and recovers by itself where it can."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest
from playwright.sync_api import Playwright

from tests.browser.chromium import open_browser
from tests.browser.conftest import Open, Serve
from tests.browser.room import Room
from tests.browser.visitor import visitor_of

pytestmark = pytest.mark.live

# The same server of a later version of the protocol.
UPGRADED = """
import sys
import cohaptic.protocol.version as version
version.PROTOCOL_VERSION += 1
version.SUBPROTOCOL = f"{version.FAMILY}{version.PROTOCOL_VERSION}"
from cohaptic.cli.app import main
sys.exit(main())
"""
MARKUP = "<img src=x onerror=alert(1)>"


@pytest.mark.smoke
def test_a_server_that_dies_and_returns_is_touched_again(visitors: Open, serve: Serve) -> None:
    room = serve()
    ann = visitors()
    ann.visit(room.address)
    ann.take_part("ann")
    ann.press(right=0.3)
    before = ann.steady_force()

    ann.away = True
    room.die()
    # In one look: while it tries, it says something else.
    said = re.compile("The server is gone.*Trying again")
    ann.until(lambda: said.search(ann.notice) is not None, "word that the server is gone")
    ann.until(lambda: not ann.force > 0.0, "the force to fade")

    room = serve(port=room.port)
    ann.until(lambda: ann.watches() and ann.notice == "", "the page to watch again")
    # The finger is still down, and so is the hand.
    assert ann.steady_force() == pytest.approx(before, rel=0.05)
    ann.until(lambda: abs(ann.force_of("ann (you)") - ann.force) < 0.05, "the panel to know it")

    # Next time it comes back newer than the page.
    room.die()
    command = [sys.executable, "-c", UPGRADED, "serve", "--port", str(room.port), "--lifeline"]
    with subprocess.Popen(
        command,
        stdin=subprocess.PIPE,  # its end is the server's
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as server:
        # On a busy machine a start takes longer than the patience with a page.
        assert server.stdout is not None
        assert server.stdout.readline().startswith("listening ")
        ann.until(lambda: "The server was upgraded" in ann.notice, "word of the upgrade")
        assert ann.page.locator(".notice button", has_text="Reload").is_visible()


def test_a_name_is_text_never_markup(visitors: Open, room: Room) -> None:
    ann = visitors()
    ann.visit(room.address)
    with room.hand(MARKUP, "--angle", "0"):
        ann.until(lambda: ann.force_of(MARKUP) > 0.0, "the guest to press")
        ann.until(lambda: ann.text(".label-name") == MARKUP, "the name on the stage")
    ann.until(lambda: "Nobody is here yet" in ann.words(), "the guest to be gone")
    ears = ann.page.locator("[role=status].for-ears")
    ann.until(lambda: ears.text_content() == f"{MARKUP} has left.", "the words")
    assert ann.page.locator("img").count() == 0


def test_without_webgl_everything_but_the_picture_goes_on(
    playwright: Playwright, room: Room
) -> None:
    browser = open_browser(playwright, ["--disable-webgl", "--disable-3d-apis"])
    with room.hand("native", "--angle", "0"):
        try:
            ann = visitor_of(browser)
            ann.visit(room.address)
            ann.until(lambda: "no 3-D graphics" in ann.notice, "word of the graphics")
            ann.until(lambda: ann.force_of("native") > 0.5, "the force of the native hand")
            assert ann.outlined, "an empty stage"
            assert ann.problems == []
        finally:
            browser.close()
