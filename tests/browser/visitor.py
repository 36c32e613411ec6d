"""A page as a person uses it: what is read, pressed and dragged, and what went wrong meanwhile."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import pytest
from _pytest.mark import ParameterSet
from playwright.sync_api import Browser, ConsoleMessage, Error, Page, Response

from cohaptic.clock import SystemClock
from cohaptic_server.http.routes import POLICY
from tests.browser.scripts import ENGINEER, TEXT, TWO_FRAMES, VIOLATIONS
from tests.patience import PATIENCE

POLL = 40  # ms between two looks
WRITTEN = 150  # ms; the page writes its numbers ten times a second, where it draws as often
# A steady force: over so many looks and seconds it does not change by more. A server that stands
# still for so long is a silent one, of which no force is shown.
MANY, LONG, STILL = 8, 1.5, 0.01  # and N
LENS = math.radians(16.0)  # half of the picture's height, seen from the eye
AWAY = 5.4  # radii of the body from its middle to the eye, in the first view
AZIMUTH = -1.36  # rad, where the eye stands then
TURN = 0.12  # rad for a key
NARROW = 1.22  # pictures less wide than this over their height are seen from farther away

CLOCK = SystemClock()
_NUMBER = r"([\d.\u2212-]+)"
# What the browser itself prints of a connection that cannot be had.
_NETWORK = re.compile(r"WebSocket connection to .* failed|net::ERR_")
_UNSOLVED = re.compile(r"responded with a status of (404|503)")
# Of the machine: one of its networks, if only a container's, has come or gone.
_CHANGED = "net::ERR_NETWORK_CHANGED"


@dataclass(frozen=True, slots=True)
class Look:
    """The window of a page.

    Args:
        width: In pixels.
        height: In pixels.
        phone: Whether it is one, with a finger for a mouse.
        engineer: Whether gains, laws and plots are open.
    """

    width: int
    height: int
    phone: bool = False
    engineer: bool = True

    def __str__(self) -> str:
        return f"{self.width}x{self.height}"


def at_night(look: Look) -> ParameterSet:
    """A parameter of a test that has this one at night only."""
    return pytest.param(look, marks=pytest.mark.night)


# Software draws every pixel: small pictures leave the cores to the hands.
SMALL = Look(640, 480)
DESKTOP = Look(1440, 900)
PHONE = Look(390, 844, phone=True)


def visitor_of(browser: Browser, look: Look = SMALL) -> Visitor:
    """A page in a window of its own, with a memory of its own."""
    context = browser.new_context(
        viewport={"width": look.width, "height": look.height},
        color_scheme="light",
        has_touch=look.phone,
        is_mobile=look.phone,
    )
    context.set_default_timeout(1000.0 * PATIENCE)
    if look.engineer:
        context.add_init_script(ENGINEER)
    return Visitor(context.new_page())


class Visitor:
    """One page of a room.

    Attributes:
        page: Playwright's handle.
        problems: What the console said that it should not have.
        policies: Content-Security-Policies that answers may have.
        away: Whether the server may be away, which the browser tells the console.
    """

    def __init__(self, page: Page) -> None:
        self.page = page
        self.problems: list[str] = []
        self.away = False
        self.policies = {POLICY}
        self._changes = 0  # of the machine's networks, which take what is being fetched with them
        page.add_init_script(VIOLATIONS)
        page.on("console", self._heard)
        page.on("pageerror", lambda error: self.problems.append(f"uncaught: {error}"))
        page.on("response", self._answered)

    def _heard(self, message: ConsoleMessage) -> None:
        if message.type not in ("error", "warning"):
            return
        if _CHANGED in message.text:
            self._changes += 1
            return
        if self.away and _NETWORK.search(message.text):
            return
        # Green's functions that wait too long, or are of an object of before: the page has the
        # surface otherwise meanwhile, but the browser prints every answer that is none.
        if "/v1/models/" in message.location["url"] and _UNSOLVED.search(message.text):
            return
        # Chromium on software WebGL, of its own speed.
        if "GPU stall due to ReadPixels" in message.text:
            return
        self.problems.append(f"{message.type}: {message.text}")

    def _answered(self, response: Response) -> None:
        policy = response.headers.get("content-security-policy")
        if policy not in self.policies:
            self.problems.append(f"{response.url} came with the policy {policy}")

    def visit(self, address: str) -> None:
        """Open the page and wait until it watches; anew where a network has changed meanwhile."""
        changes = -1

        def watches() -> bool:
            nonlocal changes
            if changes != self._changes:
                changes = self._changes
                self._go_to(address)
            return self.page.locator(".lamp").count() == 1 and self.watches()

        self.until(watches, "the page to watch")

    def _go_to(self, address: str) -> None:
        try:
            self.page.goto(address)
        except Error as error:
            if _CHANGED not in error.message:
                raise
            self._changes += 1

    def prefer(self, scheme: Literal["light", "dark"]) -> None:
        """Day or night, as the system would have it."""
        self.page.emulate_media(color_scheme=scheme)
        self.until(lambda: self.page.locator("html").get_attribute("data-theme") == scheme, scheme)

    def close(self) -> None:
        self.page.context.close()

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Wait for a condition."""
        deadline = CLOCK.now() + PATIENCE
        while not condition():
            assert CLOCK.now() < deadline, f"waited for {what}; the page says: {self.words()}"
            self.page.wait_for_timeout(POLL)

    def catch_up(self) -> None:
        """Wait until all words and numbers were written after this call, however slow the page."""
        self.page.wait_for_timeout(WRITTEN)
        self.page.evaluate(TWO_FRAMES)

    def words(self) -> str:
        """All that can be read."""
        return self.page.inner_text("body").replace("\n", " | ")

    def text(self, selector: str) -> str:
        """Of the first of these elements; empty where it is not seen."""
        return str(self.page.locator(selector).evaluate_all(TEXT))

    def watches(self) -> bool:
        """The room's messages come, and the object is drawn."""
        phase = self.page.locator(".lamp").get_attribute("data-phase")
        busy = self.page.locator(".stage-host").get_attribute("aria-busy")
        return phase == "watching" and busy == "false"

    @property
    def outlined(self) -> bool:
        """Whether an outline stands where the object will, or would."""
        host = self.page.locator(".stage-host")
        content: str = host.evaluate("(host) => getComputedStyle(host, '::before').content")
        return content != "none"

    @property
    def notice(self) -> str:
        """What it says is wrong; empty for nothing."""
        return self.text(".notice-words").replace("\n", " ")

    def turn(self, angle: float) -> None:
        """Go round the body by keys, to the right."""
        key = "ArrowRight" if angle > 0.0 else "ArrowLeft"
        self.page.locator(".stage-host").focus()
        for _ in range(round(abs(angle) / TURN)):
            self.page.keyboard.press(key)

    def take_part(self, name: str) -> None:
        """Into the room with a name, until the hand is in the air."""
        self.page.fill(".name", name)
        self.page.press(".name", "Tab")
        self.page.click(".touch-button")
        self.until(lambda: self.doing() == "in the air", "the hand to be engaged")

    def doing(self) -> str | None:
        """What the own hand does, seen or not."""
        return self.page.locator(".dock-facts").text_content()

    def choose_friction(self, mu: str) -> None:
        """Another finger; the page leaves the room with the one and comes in again."""
        self.page.locator(".dock-friction .choice-option", has_text=mu).click()

    def leave(self) -> None:
        """The hand out of the room."""
        self.page.click(".touch-button")

    def press(self, right: float = 0.0, up: float = 0.0) -> tuple[float, float]:
        """Press on the body and hold, beside its middle by shares of its radius in the picture.

        Returns:
            Where in the window [px].
        """
        box = self.page.locator(".stage-canvas").bounding_box()
        assert box is not None
        back = max(1.0, NARROW * box["height"] / box["width"])
        radius = 0.5 * box["height"] * math.tan(math.asin(1.0 / (AWAY * back))) / math.tan(LENS)
        x = box["x"] + 0.5 * box["width"] + right * radius
        # The body stands in the middle of what bar and dock leave free.
        covered = self.height(".dock") - self.height(".bar")
        y = box["y"] + 0.5 * (box["height"] - covered) - up * radius
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        return x, y

    def height(self, selector: str) -> float:
        box = self.page.locator(selector).bounding_box()
        return 0.0 if box is None else box["height"]

    def release(self) -> None:
        self.page.mouse.up()

    @property
    def force(self) -> float:
        """On the own hand, as shown [N]."""
        return _number(rf"{_NUMBER} N", self.text(".dock-force"))

    def known_force(self) -> float:
        """The same once there is one: while a busy server is silent, none is shown [N]."""
        seen = [math.nan]

        def known() -> bool:
            seen[0] = self.force
            return not math.isnan(seen[0])

        self.until(known, "a force of now")
        return seen[0]

    @property
    def from_others(self) -> float:
        """Part of it that comes from others, as shown [N]."""
        return _number(rf"{_NUMBER} N from others", self.text(".dock-facts"))

    @property
    def along(self) -> float:
        """Part of it along the surface, as shown [N]; nan for a smooth finger."""
        return _number(rf"{_NUMBER} N along", self.text(".dock-facts"))

    @property
    def lag(self) -> float:
        """In how long the object answers the others, as shown [s]; 0 for at once."""
        words = self.text(".room-time summary")
        return 0.0 if words.endswith(" at once") else _number(rf"{_NUMBER} s", words)

    def force_of(self, name: str) -> float:
        """On somebody's hand, as that one's panel shows it [N]."""
        # All at once: whoever leaves between two questions would be waited for.
        found: list[list[str]] = self.page.locator(".card[data-user]").evaluate_all(
            """(cards) => cards.map((card) => [".card-name", ".card-force"]
              .map((part) => card.querySelector(part)?.innerText ?? ""))"""
        )
        for whose, force in found:
            if whose == name:
                return _number(rf"{_NUMBER} N", force)
        return math.nan

    def steady_force(self) -> float:
        """The own force once it does not change any more."""
        since, seen = CLOCK.now(), [math.nan]

        def steady() -> bool:
            nonlocal since
            self.page.evaluate(TWO_FRAMES)  # the number of a page that does not draw is steady, too
            seen.append(self.force)
            if not (seen[-1] > 0.1 and abs(seen[-1] - seen[0]) <= STILL):
                since, seen[:] = CLOCK.now(), seen[-1:]
            return len(seen) > MANY and CLOCK.now() - since > LONG

        self.until(steady, "a steady force")
        return seen[-1]


def _number(pattern: str, text: str) -> float:
    found = re.search(pattern, text)
    return math.nan if found is None else float(found[1].replace("\u2212", "-"))
