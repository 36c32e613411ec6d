"""Pages of a server with several rooms: each touches in its own, and comes back to it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from cohaptic_server.shell.listener import page_address
from cohaptic_tools.demo.processes import Process
from tests.browser.conftest import Open
from tests.browser.visitor import Visitor
from tests.patience import PATIENCE
from tests.server.shell.nginx import NEEDS_NGINX, proxied

pytestmark = [
    pytest.mark.live,
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


def feels(visitor: Visitor, least: float) -> bool:
    """Whether the force on its hand is larger [N]."""
    return visitor.force > least


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
        visitor.until(partial(feels, visitor, 0.5), "a force")
    ann.until(lambda: users(address) == {"first": 1, "second": 1}, "both in the list")

    (pid,) = re.findall(r"room second is open, process (\d+)", log.read_text())
    ann.away = True  # what the browser prints of connections that are lost
    os.kill(int(pid), signal.SIGKILL)
    ann.until(lambda: len(re.findall("second is open", log.read_text())) == 2, "the room again")
    ann.until(lambda: users(address) == {"first": 1, "second": 1}, "ann back in the list")
    assert bob.known_force() > 0.5
    assert log.read_text().count("[first] bob joined") == 1


def cohaptic(*arguments: str) -> str:
    """What a command says."""
    command = [sys.executable, "-m", "cohaptic", *arguments]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=PATIENCE, check=True
    ).stdout.strip()


def test_a_stranger_comes_by_a_link_is_put_out_of_one_room_and_has_another_left(
    tmp_path: Path, visitors: Open
) -> None:
    path, keys = tmp_path / "rooms.toml", tmp_path / "keys.json"
    path.write_text(f"{CONFIG}[access]\nkeys = 'keys.json'\n")
    cohaptic("key", str(keys))
    process = Process("serve", "--config", str(path), log=tmp_path / "server.log")
    url = process.first_line().removeprefix("listening ")
    address = page_address(url)

    def link(room: str) -> str:
        return cohaptic("invite", address, "--room", room, "--keys", str(keys))

    ann, bare = visitors(), visitors()
    first, second = link("first"), link("second")
    ann.visit(second)
    ann.visit(first)
    assert ann.page.url == f"{address}r/first/"
    ann.take_part("ann")
    ann.press()
    ann.until(lambda: ann.force > 0.5, "a force")
    bare.page.goto(f"{address}r/first/")
    bare.until(lambda: "You need an invitation" in bare.notice, "word that one is needed")
    # Without a slash at the end of the path the browser is sent on, and takes what is behind #.
    bare.page.goto(first.replace("/r/first/", "/r/first"))
    bare.until(bare.watches, "the object")

    admin = cohaptic("token", "--room", "first", "--admin", "--keys", str(keys))
    cohaptic("admin", url, "kick", "ann", "--room", "first", "--token", admin)
    ann.until(lambda: "put out of this room" in ann.page.content(), "word that she was put out")
    ann.page.reload()
    ann.until(lambda: "put out of this room" in ann.page.content(), "the same when she is back")
    # The tab has the other room's invitation as well.
    ann.page.goto(f"{address}r/second/")
    ann.until(ann.watches, "the other room")
    ann.away = bare.away = True
    process.wait()


@NEEDS_NGINX
def test_pages_below_a_path_of_a_proxy_find_their_rooms(tmp_path: Path, visitors: Open) -> None:
    path = tmp_path / "rooms.toml"
    path.write_text(f"base_path = '/haptics/'\n{CONFIG}")
    process = Process("serve", "--config", str(path), log=tmp_path / "server.log")
    url = process.first_line().removeprefix("listening ")
    # The browser of the test trusts no certificate of the test.
    changes = (("location /", "location /haptics"), ("listen 443 ssl", "listen 443"))
    with proxied(url, tmp_path, *changes) as port:
        address = f"http://127.0.0.1:{port}/haptics"
        ann = visitors()
        ann.page.goto(address)
        ann.page.get_by_role("link", name="The second").click()
        ann.until(ann.watches, "the object")
        assert ann.page.url == f"{address}/r/second/"
        ann.problems.clear()  # of the list, which has a policy of its own
        ann.take_part("ann")
        ann.press()
        ann.until(partial(feels, ann, 0.5), "a force")
        ann.until(lambda: users(f"{address}/") == {"first": 0, "second": 1}, "her in the list")
        with urllib.request.urlopen(f"{address}/rooms", timeout=PATIENCE) as answer:
            paths = [room["path"] for room in json.load(answer)["rooms"]]
        assert paths == ["/haptics/r/first", "/haptics/r/second"]
        ann.away = True
    process.wait()
