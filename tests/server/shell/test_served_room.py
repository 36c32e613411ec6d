"""A room that a script serves."""

from __future__ import annotations

import asyncio
import threading
import urllib.error
import urllib.request
from typing import Any

import pytest

from cohaptic.errors import SettingError
from cohaptic_server import ServedRoom, serve

pytestmark = pytest.mark.live


def test_it_is_served_while_the_block_runs_and_not_longer() -> None:
    before = threading.active_count()
    with serve("balloon", port=0) as room:
        with urllib.request.urlopen(room.page, timeout=60.0) as page:
            assert b"cohaptic" in page.read()
        assert room.users == ()
        assert room.wait(0.0)
    assert not room.wait(0.0)
    assert threading.active_count() == before
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(room.page, timeout=60.0)


def test_it_runs_on_the_event_loop_of_the_block() -> None:
    async def serve_it() -> int:
        async with serve("balloon", port=0) as room:
            begun = room.ticks
            while room.ticks < begun + 3:
                await asyncio.sleep(0.01)
            return threading.active_count()

    assert asyncio.run(serve_it()) >= 1


def test_a_port_that_is_taken_is_an_error_at_the_beginning_of_the_block() -> None:
    with serve("balloon", port=0) as room:
        port = int(room.url.rpartition(":")[2])
        with pytest.raises(SettingError, match=str(port)), serve("balloon", port=port):
            pytest.fail("it is served twice")
        assert room.wait(0.0)


@pytest.mark.parametrize("wrong", [{"max_users": 0}, {"simulation_hz": 1.0}, {"body": "cloud"}])
def test_a_wrong_setting_is_an_error_before_the_block(wrong: dict[str, Any]) -> None:
    body = str(wrong.pop("body", "balloon"))
    with pytest.raises(SettingError):
        serve(body, port=0, **wrong)


def test_one_room_can_be_served_twice_and_says_where_it_is_not() -> None:
    served = serve("balloon", port=0)
    with pytest.raises(RuntimeError, match="inside its block"):
        _ = served.users
    for _ in range(2):
        with served as room:
            assert room.wait(0.0)


def test_a_script_lets_a_notebook_show_the_page_and_a_bounded_number_of_them() -> None:
    given = "https://lab.example"

    def policy(room: ServedRoom) -> str:
        with urllib.request.urlopen(room.page, timeout=60.0) as page:
            said: str = page.headers["Content-Security-Policy"]
        return said.partition("frame-ancestors ")[2]

    with serve("balloon", port=0, allow_frames=(given,)) as room:
        assert policy(room) == given
        room.allow_frame("http://localhost:8888")
        room.allow_frame("http://localhost:8888")
        assert policy(room) == f"{given} http://localhost:8888"
        for wrong in ("*", "vscode-webview://1c2d", "http://a.example; script-src *"):
            with pytest.raises(SettingError, match="frame"):
                room.allow_frame(wrong)
        for port in range(20):
            room.allow_frame(f"http://localhost:{port}")
        assert policy(room).split() == [given, *(f"http://localhost:{p}" for p in range(12, 20))]
