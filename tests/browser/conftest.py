from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Playwright, sync_playwright

from cohaptic_server.bodies.balloon.balloon import Balloon
from tests.browser.chromium import open_browser
from tests.browser.room import Room
from tests.browser.visitor import SMALL, Look, Visitor, visitor_of

Open = Callable[..., Visitor]
Serve = Callable[..., Room]


@pytest.fixture(scope="package")
def playwright() -> Iterator[Playwright]:
    """Of the package only: while it is there, no other test could run an event loop."""
    with sync_playwright() as playwright:
        yield playwright


@pytest.fixture(scope="package")
def browser(playwright: Playwright) -> Iterator[Browser]:
    browser = open_browser(playwright)
    yield browser
    browser.close()


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[Serve]:
    """Starts servers that end with the test."""
    rooms: list[Room] = []

    def start(*options: str, port: int = 0) -> Room:
        rooms.append(Room(tmp_path, *options, port=port))
        return rooms[-1]

    yield start
    for room in rooms:
        room.close()


@pytest.fixture
def visitors(browser: Browser, serve: Serve) -> Iterator[Open]:
    """Opens pages; at the end none may have had a word for the console.

    They are closed before the test's own servers: a page whose server ends tells the console.
    """
    del serve
    opened: list[Visitor] = []

    def open_one(look: Look = SMALL) -> Visitor:
        opened.append(visitor_of(browser, look))
        return opened[-1]

    yield open_one
    for visitor in opened:
        visitor.close()
    assert [problem for visitor in opened for problem in visitor.problems] == []


@pytest.fixture(scope="package")
def shared_room(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Room]:
    room = Room(tmp_path_factory.mktemp("room"), "--allow-latency", "--allow-fixed-gains")
    yield room
    room.close()


@pytest.fixture
def room(shared_room: Room) -> Room:
    """A server that allows everything, with nobody on its body."""
    shared_room.until(lambda users: not users, "those of the test before to be gone")
    return shared_room


@pytest.fixture(scope="package")
def body() -> Balloon:
    """What the servers serve."""
    return Balloon()
