"""Watching on real sockets: what only the shell can get wrong."""

from __future__ import annotations

import array
import asyncio
import contextlib
import fcntl
import http.client
import itertools
import logging
import math
import socket
import termios
from collections.abc import AsyncGenerator
from dataclasses import dataclass, field

import numpy as np
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Origin, Subprotocol

from cohaptic.errors import CloseCode
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.messages import Bye, Error, UserJoined, UserLeft, encode_control
from cohaptic.protocol.rest_mesh import MAX_BYTES, RestMesh
from cohaptic.protocol.scene import Scene
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import (
    EncodingName,
    Latency,
    SetLatency,
    SetView,
    Watch,
    WatchControl,
    Watching,
    decode_watch_control,
)
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.http.green_functions import decode_block, green_source
from cohaptic_server.http.page_files import FOLDER
from cohaptic_server.room.watch.watcher import DROPPED_AFTER, IN_FLIGHT, SLOW_AFTER
from tests.server.shell.stage import PATIENCE, SIMULATION_HZ, Client, Serving, serving, visit

AGES = 6.0 * PATIENCE  # s; for a test that moves the clock
BOUND = 256 * 1024  # bytes that one who watches may cost


@dataclass
class Page:
    """One who watches."""

    ws: ClientConnection
    watching: Watching
    mesh: RestMesh
    traversal: Traversal
    news: list[WatchControl] = field(default_factory=list[WatchControl])

    async def hear(self) -> Scene | WatchControl:
        data = await self.ws.recv()
        if isinstance(data, bytes):
            return Scene.decode(data, self.traversal)
        self.news.append(decode_watch_control(data))
        return self.news[-1]

    async def scene(self, wants: int = 0) -> Scene:
        """The next scene, acknowledged."""
        while True:
            message = await self.hear()
            if isinstance(message, Scene):
                await self.ws.send(Ack(message.tick, wants).encode())
                return message

    async def told(self, kind: type[WatchControl]) -> WatchControl:
        """The next news of a kind; scenes meanwhile are acknowledged."""
        while True:
            message = await self.hear()
            if isinstance(message, Scene):
                await self.ws.send(Ack(message.tick).encode())
            elif isinstance(message, kind):
                return message

    async def end(self) -> tuple[int, str]:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await self.hear()
        return self.ws.close_code or 0, self.ws.close_reason or ""


@contextlib.asynccontextmanager
async def watching(
    url: str,
    encoding: EncodingName = "frames",
    rate: float = 60.0,
    sock: socket.socket | None = None,
) -> AsyncGenerator[Page]:
    async with (
        asyncio.timeout(AGES),
        connect(
            url,
            subprotocols=[Subprotocol(SUBPROTOCOL)],
            compression=None,
            proxy=None,
            max_size=MAX_BYTES,
            sock=sock,
        ) as ws,
    ):
        watch = Watch(protocol=PROTOCOL_VERSION, encoding=encoding, rate=rate)
        await ws.send(encode_control(watch))
        first, second = await ws.recv(), await ws.recv()
        assert isinstance(first, str)
        assert isinstance(second, bytes)
        answer, mesh = decode_watch_control(first), RestMesh.decode(second)
        assert isinstance(answer, Watching)
        yield Page(ws, answer, mesh, Traversal.of(len(mesh.vertices), mesh.faces))


@contextlib.asynccontextmanager
async def pressing(served: Serving, name: str = "ann") -> AsyncGenerator[Client]:
    """A user who presses, and goes on while others do something."""
    async with visit(served.url) as client:
        client.probe, client.force = (0.09, 0.0, 0.0), (2.0, 0.0, 0.0)
        await client.join(name)
        await client.touch()

        async def play() -> None:
            for step in itertools.count():
                client.force = (2.0 + math.sin(0.3 * step), 0.0, 0.0)
                await client.play(1)

        playing = asyncio.ensure_future(play())
        try:
            yield client
        finally:
            playing.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
                await playing


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


def test_who_watches_hears_of_comings_and_goings_and_sees_the_force_fade(
    small_balloon: Balloon,
) -> None:
    async def play() -> None:
        async with serving(small_balloon) as served, watching(served.url) as page:
            assert page.watching.users == ()
            async with pressing(served, "bob") as client:
                came = await page.told(UserJoined)
                assert came == UserJoined(user=1, name="bob")
                while not (await page.scene()).users:
                    pass
                await client.ws.send(encode_control(Bye()))
                left = await page.told(UserLeft)
                assert left == UserLeft(user=1, name="bob", reason="bye")
            while (await page.scene()).users:
                pass

    asyncio.run(play())


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (Ack(4_000_000_000).encode(), "tick of an ack is 4000000000"),
        (bytes([PROTOCOL_VERSION, 1, 0, 0]), "frame kind is 1; expected 5"),
        (encode_control(SetLatency(user=1, delay=0.1)), "--allow-latency"),
    ],
)
def test_a_mistake_ends_the_connection_that_made_it(
    small_balloon: Balloon, said: str | bytes, words: str
) -> None:
    async def play() -> None:
        async with (
            serving(small_balloon) as served,
            watching(served.url) as good,
            watching(served.url) as bad,
        ):
            await bad.ws.send(said)
            code, reason = await bad.end()
            assert code == CloseCode.BAD_MESSAGE.value
            assert words in reason
            assert isinstance(bad.news[-1], Error)
            async with pressing(served):
                assert (await good.scene()).tick > 0

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
            known = set(server.audience.watchers)
            # A window of a few kB, as of one who is far away; then it reads nothing any more.
            narrow = socket.socket()
            narrow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            host, port = served.url.removeprefix("ws://").split(":")
            narrow.connect((host, int(port)))
            narrow.setblocking(False)
            async with watching(served.url, sock=narrow) as bad:
                (watcher,) = set(server.audience.watchers) - known
                peers = [c for c in server.connections if c.session is watcher]
                bad.ws.transport.pause_reading()
                most = 0
                for _ in range(20):
                    await good.scene()
                    most = max(most, unread(peers[0].ws))
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
                return most, watcher.close[0]

    most, code = asyncio.run(play())
    assert code == CloseCode.TOO_SLOW.value
    assert most <= BOUND
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


def test_the_port_serves_pages_blocks_and_health_too(small_balloon: Balloon) -> None:
    source = green_source(small_balloon)
    assert source is not None

    async def play() -> None:
        async with serving(small_balloon) as served, watching(served.url, "forces") as page:
            model = page.watching.model
            assert model is not None
            status, headers, body = await asyncio.to_thread(
                get, served.url, f"/v1/models/{model}/green/7"
            )
            assert status == 200
            assert "immutable" in headers["Cache-Control"]
            want = source.green(7)
            assert np.abs(decode_block(body) - want).max() <= 1e-4 * np.abs(want).max()
            status, headers, body = await asyncio.to_thread(get, served.url, "/healthz")
            assert (status, body) == (200, b"ok\n")
            assert headers["Content-Security-Policy"].startswith("default-src 'none'")
            status, _, body = await asyncio.to_thread(get, served.url, "/", "HEAD")
            assert (status, body) == (200, b"")
            status, _, body = await asyncio.to_thread(get, served.url, "/../pyproject.toml")
            assert status == 404
            status, _, body = await asyncio.to_thread(get, served.url, "/")
            assert (b"make page" in body) == (not (FOLDER / "index.html").exists())

    asyncio.run(play())


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


def test_injected_latency_delays_both_ways_is_told_to_all_and_stops(
    small_balloon: Balloon,
) -> None:
    delay = 0.1  # s

    async def round_trip(client: Client) -> int:
        """Ticks from the newest patch until the one that contains the next sample."""
        newest = (await client.play(1))[0].tick
        await client.touch()
        seq = client.seq
        while True:
            (patch,) = await client.play(1)
            if patch.seq >= seq:
                return patch.tick - newest

    async def play() -> tuple[int, int, int]:
        async with (
            serving(small_balloon, allow_latency=True) as served,
            watching(served.url) as page,
            watching(served.url) as other,
            visit(served.url) as client,
        ):
            assert page.watching.allow_latency
            user = await client.join("ann")
            await client.touch()
            before = await round_trip(client)
            change = SetLatency(user=user, delay=delay)
            await page.ws.send(encode_control(change))
            news = Latency(user=user, delay=delay, jitter=0.0)
            for one in (page, other):
                assert await one.told(Latency) == news
            async with watching(served.url) as late:
                assert await late.told(Latency) == news
            during = max([await round_trip(client) for _ in range(3)])
            # One who is not there is passed over; a fool's rush is one piece of news.
            await page.ws.send(encode_control(SetLatency(user=999, delay=1.0)))
            await page.ws.send(encode_control(SetLatency(user=user, delay=0.0)))
            assert await other.told(Latency) == Latency(user=user, delay=0.0, jitter=0.0)
            after = [await round_trip(client) for _ in range(4)]
            return before, during, after[-1]

    before, during, after = asyncio.run(play())
    # Both ways, in ticks of the server: exact but for one tick at each end.
    assert during >= 2.0 * delay * SIMULATION_HZ - 2
    assert after <= before + 0.5 * delay * SIMULATION_HZ


def test_what_was_said_within_the_delay_still_counts(small_balloon: Balloon) -> None:
    async def play() -> WatchControl:
        async with (
            serving(small_balloon, allow_latency=True) as served,
            watching(served.url) as page,
            visit(served.url) as client,
        ):
            user = await client.join("ann")
            await page.ws.send(encode_control(SetLatency(user=user, delay=1.0)))
            await page.told(Latency)
            await client.ws.send(encode_control(Bye()))
            await client.ws.close()
            return await page.told(UserLeft)

    assert asyncio.run(play()) == UserLeft(user=1, name="ann", reason="bye")
