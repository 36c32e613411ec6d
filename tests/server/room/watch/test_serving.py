"""Watching on real sockets: what only the shell can get wrong."""

from __future__ import annotations

import array
import asyncio
import fcntl
import http.client
import logging
import socket
import termios

import numpy as np
import pytest
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import InvalidStatus
from websockets.typing import Origin

from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.watch_messages import (
    SetView,
)
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.room.watch.watcher import DROPPED_AFTER, IN_FLIGHT, SLOW_AFTER
from tests.patience import PATIENCE
from tests.server.room.watch.pages import pressing, watching
from tests.server.shell.stage import SIMULATION_HZ, serving, visit

pytestmark = pytest.mark.live

BOUND = 256 * 1024  # bytes that one who watches may cost


def test_who_watches_gets_the_mesh_then_the_scene_at_once_then_what_moves(
    small_balloon: Balloon,
) -> None:
    async def play() -> None:
        async with serving(small_balloon) as served:
            async with pressing(served), watching(served.url) as early:
                assert len(early.mesh.vertices) == len(small_balloon.mesh.vertices)
                assert early.watching.simulation_period == 1.0 / SIMULATION_HZ
                scenes = [await early.scene() for _ in range(20)]
                ticks = [scene.tick for scene in scenes]
                assert ticks == sorted(set(ticks))
                last = scenes[-1]
                assert last.surface is not None
                world = served.server.room.world
                assert world.response is not None
                depth = np.abs(world.response.displacement).max()
                assert np.abs(last.surface.displacement).max() > 0.5 * depth
                async with watching(served.url, "forces") as late:
                    first = await late.scene(wants=1)
                    assert [user.user for user in first.users] == [1]
                    assert first.surface is None
                    # One may have been on its way before it asked for the surface.
                    await late.scene(wants=1)
                    assert (await late.scene(wants=0)).surface is not None
                    await late.scene()
                    assert (await late.scene()).surface is None
                    await late.ws.send(encode_control(SetView(encoding="frames", rate=60.0)))
                    await late.scene()
                    await late.scene()
                    assert (await late.scene()).surface is not None
                    assert late.watching.users[0].name == "ann"

    asyncio.run(play())


def unread(ws: ServerConnection) -> int:
    """Bytes written to a socket that its peer's kernel has not taken."""
    count = array.array("i", [0])
    fcntl.ioctl(ws.transport.get_extra_info("socket").fileno(), termios.TIOCOUTQ, count)
    return count[0] + ws.transport.get_write_buffer_size()


def test_who_stops_reading_costs_little_is_called_slow_and_then_dropped(
    balloon: Balloon, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "cohaptic.server")

    async def play() -> tuple[int, int]:
        async with serving(balloon) as served, pressing(served), watching(served.url) as good:
            server = served.server
            known = set(server.scene_broadcast.watchers)
            # A window of a few kB, as of one who is far away; then it reads nothing any more.
            narrow = socket.socket()
            narrow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            host, port = served.url.removeprefix("ws://").split(":")
            narrow.connect((host, int(port)))
            narrow.setblocking(False)
            async with watching(served.url, sock=narrow) as bad:
                (watcher,) = set(server.scene_broadcast.watchers) - known
                peers = [c for c in server.connections if c.session is watcher]
                bad.ws.transport.pause_reading()
                largest = 0
                for _ in range(20):
                    await good.scene()
                    largest = max(largest, unread(peers[0].ws))
                server.clock.origin += SLOW_AFTER
                await good.scene()
                await good.scene()
                assert watcher.slow
                assert any("is slow" in record.message for record in caplog.records)
                server.clock.origin += DROPPED_AFTER
                for _ in range(3):
                    await good.scene()
                assert watcher.close is not None
                assert "wait for one" in watcher.close[1]
                bad.ws.transport.abort()  # it would not read the server's close either
                return largest, watcher.close[0]

    largest, code = asyncio.run(play())
    assert code == CloseCode.TOO_SLOW.value
    assert largest <= BOUND
    assert IN_FLIGHT == 2


def get(url: str, path: str, method: str = "GET") -> tuple[int, dict[str, str], bytes]:
    """One request, as a browser makes it."""
    connection = http.client.HTTPConnection(url.removeprefix("ws://"), timeout=PATIENCE)
    try:
        connection.request(method, path)
        response = connection.getresponse()
        return response.status, dict(response.getheaders()), response.read()
    finally:
        connection.close()


@pytest.mark.parametrize(
    ("host", "origin", "status"),
    [
        ("0.0.0.0", "http://{0}", 101),
        ("0.0.0.0", "http://elsewhere.example", 403),
        ("127.0.0.1", "https://lab.example", 101),
        ("127.0.0.1", "https://elsewhere.example", 403),
    ],
)
def test_whose_page_may_connect(
    small_balloon: Balloon, host: str, origin: str, status: int
) -> None:
    async def play() -> int:
        allowed = ("https://lab.example",)
        async with serving(small_balloon, host=host, allow_origins=allowed) as served:
            address = served.url.removeprefix("ws://").replace("0.0.0.0", "127.0.0.2")
            try:
                async with visit(f"ws://{address}", origin=Origin(origin.format(address))):
                    return 101
            except InvalidStatus as refused:
                return refused.response.status_code

    assert asyncio.run(play()) == status
