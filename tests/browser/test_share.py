"""The address of a room, for somebody else: read, photographed or copied, and it leads here."""

from __future__ import annotations

import re
import shlex
import urllib.request

import pytest

from tests.browser.conftest import Open, Serve
from tests.browser.test_sizes import OUT
from tests.browser.visitor import DESKTOP, Look, Visitor

pytestmark = pytest.mark.live

SIZES = [Look(390, 844, phone=True), Look(820, 1180), Look(1280, 800)]


def ask(visitor: Visitor) -> None:
    handle = visitor.page.locator(".sheet-handle")
    if handle.is_visible():
        handle.click()
    visitor.page.click(".share-button")
    visitor.until(lambda: visitor.page.locator("dialog[open]").is_visible(), "the dialog")


def picture(visitor: Visitor, name: str) -> None:
    OUT.mkdir(parents=True, exist_ok=True)
    for scheme in ("light", "dark"):
        visitor.page.emulate_media(color_scheme=scheme)
        visitor.catch_up()
        width = visitor.page.evaluate("innerWidth")
        visitor.page.screenshot(path=OUT / f"{name}-{width}-{scheme}.png", caret="initial")


@pytest.mark.parametrize("look", SIZES, ids=[f"{look.width}" for look in SIZES])
def test_the_page_of_this_machine_offers_an_address_that_another_machine_reaches(
    visitors: Open, serve: Serve, look: Look
) -> None:
    room = serve("--host", "0.0.0.0", "--open", "--insecure", "--allow-host", "lab.example")
    ann = visitors(look)
    ann.visit(f"http://localhost:{room.port}/")
    # The places of dialogs, which are empty before they are asked for, are no rows of the page.
    if not look.phone:
        assert ann.height(".stage") == ann.page.evaluate("innerHeight")
    ask(ann)
    ann.until(lambda: ann.page.locator(".share-qr").is_visible(), "the QR code")
    assert ann.page.input_value(".share-address") == f"http://lab.example:{room.port}/"
    offered = ann.page.locator("dialog[open] option").all()
    addresses = [str(option.get_attribute("value")) for option in offered]
    for address in addresses[1:]:
        assert not re.search(r"localhost|//127\.|//0\.0\.0\.0", address)
        with urllib.request.urlopen(address) as answer:
            assert answer.status == 200
    picture(ann, "share")
    for part in ("dialog[open]", ".share-qr", ".share-address"):
        box = ann.page.locator(part).bounding_box()
        assert box is not None
        assert box["x"] >= 0.0
        assert box["x"] + box["width"] <= look.width
        assert box["y"] + box["height"] <= look.height
    ann.page.keyboard.press("t")  # of the dialog, and no touch
    ann.page.keyboard.press("Escape")
    ann.until(lambda: not ann.page.locator("dialog[open]").is_visible(), "the dialog to close")
    assert room.users() == {}


def test_the_command_that_the_page_gives_lets_others_in(visitors: Open, serve: Serve) -> None:
    room = serve()
    ann = visitors(DESKTOP)
    ann.away = True
    ann.visit(room.address)
    ask(ann)
    ann.until(lambda: ann.text(".share-command") != "", "the command")
    picture(ann, "share-alone")
    ann.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    ann.page.locator(".share-command + .button").click()
    ann.until(lambda: "Copied" in ann.text("dialog[open]"), "the copy")
    command = shlex.split(ann.page.evaluate("navigator.clipboard.readText()"))
    assert command[:2] == ["cohaptic", "serve"]
    at = command.index("--port")
    assert int(command[at + 1]) == room.port
    room.close()
    serve(*command[2:at], *command[at + 2 :], port=room.port)
    ann.page.keyboard.press("Escape")
    ann.until(lambda: ann.watches() and ann.notice == "", "the page to have come back")
    ask(ann)
    ann.until(lambda: ann.page.locator(".share-qr").is_visible(), "an address for others")
