"""Pages of a server with several rooms: each touches in its own, and comes back to it."""

from __future__ import annotations

import json
import os
import re
import signal
import sys
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from cohaptic_server.demo.processes import Process
from cohaptic_server.shell.listener import page_address
from tests.browser.conftest import Open
from tests.browser.visitor import PATIENCE

pytestmark = [
    pytest.mark.patient,
    pytest.mark.skipif(sys.platform == "win32", reason="hands sockets over"),
]

CONFIG = """
port = 0
[rooms.first]
body = "balloon"
[rooms.second]
body = "balloon"
title = "The second"
"""


@pytest.fixture
def server(tmp_path: Path) -> Iterator[tuple[str, Path]]:
    """Address and log."""
    path, log = tmp_path / "rooms.toml", tmp_path / "server.log"
    path.write_text(CONFIG)
    process = Process("serve", "--config", str(path), log=log)
    yield page_address(process.first_line().removeprefix("listening ")), log
    process.wait()


def users(address: str) -> dict[str, int]:
    with urllib.request.urlopen(f"{address}rooms", timeout=PATIENCE) as answer:
        return {room["name"]: room["users"] for room in json.load(answer)["rooms"]}


def test_a_page_touches_in_its_own_room_and_comes_back_when_that_was_killed(
    server: tuple[str, Path], visitors: Open
) -> None:
    address, log = server
    ann, bob = visitors(), visitors()
    # By the list, as a person finds it; and by an address without a slash at its end.
    ann.page.goto(address)
    ann.page.get_by_role("link", name="The second").click()
    ann.until(ann.watches, "the object")
    # The list has a policy of its own, and nothing but that is to be said of it.
    assert [problem.partition(" ")[0] for problem in ann.problems] == [address]
    ann.problems.clear()
    assert ann.page.url == f"{address}r/second/"
    bob.visit(f"{address}r/first")
    for visitor, name in ((ann, "ann"), (bob, "bob")):
        visitor.take_part(name)
        visitor.press()
        visitor.until(lambda visitor=visitor: visitor.force > 0.5, "a force")  # type: ignore[misc]
    ann.until(lambda: users(address) == {"first": 1, "second": 1}, "both in the list")

    (pid,) = re.findall(r"room second is open, process (\d+)", log.read_text())
    ann.away = True  # what the browser prints of connections that are lost
    os.kill(int(pid), signal.SIGKILL)
    ann.until(lambda: len(re.findall("second is open", log.read_text())) == 2, "the room again")
    ann.until(lambda: users(address) == {"first": 1, "second": 1}, "ann back in the list")
    assert bob.force > 0.5
    assert log.read_text().count("[first] bob joined") == 1
