"""What a page shows while nothing comes: a server that stands still, a network that swallows."""

from __future__ import annotations

import math
import os
import re
import signal
import socket
import threading
from collections.abc import Generator
from contextlib import contextmanager

import numpy as np
import pytest

from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.test_watch import picture
from tests.browser.visitor import Look, Visitor

pytestmark = pytest.mark.live

GREY = 0.03  # most that the channels of a pixel differ in a picture without colour
COLOURED = 0.15


def colour(visitor: Visitor) -> float:
    """How far the channels lie apart, in the middle of the body, where nothing stands over it."""
    image = picture(visitor)
    high, wide, _ = image.shape
    image = image[int(0.45 * high) : int(0.65 * high), int(0.4 * wide) : int(0.6 * wide)]
    return float(np.quantile(image.max(axis=2) - image.min(axis=2), 0.99))


def resting_colour(visitor: Visitor) -> float:
    """The same once it does not change any more: a hand may still be on its way in."""
    seen = [math.nan]

    def rests() -> bool:
        visitor.page.wait_for_timeout(1000)
        visitor.catch_up()
        seen.append(colour(visitor))
        return len(seen) > 3 and max(seen[-3:]) - min(seen[-3:]) < 0.01

    visitor.until(rests, "the colour to stay")
    return seen[-1]


def lamp(visitor: Visitor) -> str | None:
    return visitor.page.locator(".lamp").get_attribute("data-phase")


def stays_live(visitor: Visitor, looks: int) -> None:
    """So many looks one after another find it so, in three seconds for sixty.

    Without signs of life a page is silent after one, so that there would never be so many. After a
    second in which a busy machine let nobody speak it is counted anew.
    """
    seen = 0

    def live() -> bool:
        nonlocal seen
        visitor.page.wait_for_timeout(50)
        seen = seen + 1 if lamp(visitor) == "watching" else 0
        return seen >= looks

    visitor.until(live, "a page that stays live")


def amber(visitor: Visitor) -> bool:
    lamp = visitor.page.locator(".lamp")
    ink = "node => getComputedStyle(node).backgroundColor"
    busy = "() => getComputedStyle(document.documentElement).getPropertyValue('--busy').trim()"
    red, green, blue = (int(x) for x in re.findall(r"\d+", lamp.evaluate(ink)))
    wanted: str = visitor.page.evaluate(busy)
    return f"#{red:02x}{green:02x}{blue:02x}" == wanted


def looks_dead(visitor: Visitor) -> None:
    """No number is shown as if it were of now."""
    visitor.catch_up()  # of what is written at one time each part looks at the clock by itself
    assert amber(visitor)
    assert re.search(r"no word for \d+ s", visitor.text(".room"))
    forces = visitor.page.locator(".card .card-force").all_inner_texts()
    assert forces
    assert set(forces) == {"\u2013"}
    assert colour(visitor) < GREY
    cut = visitor.page.locator(".dock canvas")
    assert "grayscale(1)" in cut.evaluate("node => getComputedStyle(node).filter")


@pytest.mark.parametrize("quiet", [False, True], ids=["in motion", "at rest"])
def test_a_server_that_stands_still_does_not_look_live(
    visitors: Open, room: Room, *, quiet: bool
) -> None:
    ann = visitors()
    ann.visit(room.address)
    rhythm = () if quiet else ("--rhythm-s", "2")
    with room.hand("native", "--angle", "-80", "--depth-mm", "30", *rhythm):
        ann.until(lambda: ann.force_of("native") > 0.5, "the native hand to press")
        ann.until(lambda: colour(ann) > COLOURED, "the picture to have colour")
        # A room in which nothing moves is live all the same.
        stays_live(ann, looks=60 if quiet else 1)
        ann.away = True  # of the attempts to come
        os.kill(room.pid, signal.SIGSTOP)
        try:
            ann.until(lambda: lamp(ann) == "silent", "word of the silence")
            ann.until(lambda: "No word from the server" in ann.notice, "the notice")
            looks_dead(ann)
            ann.until(lambda: lamp(ann) != "silent", "it to try again")
            looks_dead(ann)
        finally:
            os.kill(room.pid, signal.SIGCONT)
        ann.until(lambda: ann.watches() and ann.notice == "", "the page to come back")
        ann.until(lambda: ann.force_of("native") > 0.5, "the native hand to press again")
        ann.until(lambda: colour(ann) > COLOURED, "the colour to come back")


@contextmanager
def network(port: int) -> Generator[tuple[int, threading.Event]]:
    """A way to a server that passes everything on, until its event is set: then nothing."""
    swallows, ends = threading.Event(), threading.Event()
    acceptor = socket.create_server(("127.0.0.1", 0))
    acceptor.settimeout(0.1)
    open_ones: list[socket.socket] = [acceptor]

    def carry(source: socket.socket, target: socket.socket) -> None:
        try:
            while data := source.recv(65536):
                if not swallows.is_set():
                    target.sendall(data)
            target.shutdown(socket.SHUT_WR)
        except OSError:
            return

    def accept() -> None:
        while not ends.is_set():
            try:
                here, _ = acceptor.accept()
            except OSError:
                continue
            there = socket.create_connection(("127.0.0.1", port))
            open_ones.extend((here, there))
            for pair in ((here, there), (there, here)):
                threading.Thread(target=carry, args=pair, daemon=True).start()

    accepting = threading.Thread(target=accept, daemon=True)
    accepting.start()
    try:
        yield acceptor.getsockname()[1], swallows
    finally:
        ends.set()
        accepting.join()
        for one in open_ones:
            one.close()


def test_a_hand_behind_a_network_that_swallows_everything_comes_back(
    visitors: Open, room: Room
) -> None:
    with network(room.port) as (port, swallows):
        # So large that the dock of who takes part does not stand before the middle of the body.
        ann = visitors(Look(1024, 720))
        ann.visit(f"http://127.0.0.1:{port}/")
        ann.take_part("ann")
        ann.press(right=0.3)
        before = ann.steady_force()
        ann.away = True
        swallows.set()
        ann.until(lambda: lamp(ann) != "watching", "word of the silence")
        ann.until(lambda: ann.text(".dock-force") == "\u2013", "the own force to be unknown")
        looks_dead(ann)
        swallows.clear()
        ann.until(lambda: ann.watches() and ann.notice == "", "the page to come back")
        assert ann.steady_force() == pytest.approx(before, rel=0.05)
