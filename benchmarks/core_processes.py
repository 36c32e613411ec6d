"""The processes of `users_per_core.py`: a bare server, ours, and the users of either.

A server answers each word on its pipe with its CPU seconds so far, and those of them in the world.
"""

from __future__ import annotations

import asyncio
import contextlib
import sys
import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from multiprocessing.connection import Connection as Pipe

from threadpoolctl import threadpool_limits
from websockets.asyncio.server import ServerConnection, broadcast, serve
from websockets.exceptions import ConnectionClosed

from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.room.room import Room
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.server import CohapticServer

PERIOD = 1.0 / 60.0  # s
MAX_USERS = 64  # of one room
_SETTLE = 20  # ticks of the world in which forces rise


async def _report(pipe: Pipe, url: str, world: Callable[[], float], done: Awaitable[None]) -> None:
    """Say where the server is, then what it has cost whenever it is asked, until the pipe ends."""
    ended = asyncio.get_running_loop().create_future()

    def answer() -> None:
        try:
            pipe.recv()
            pipe.send((time.process_time(), world()))
        except EOFError:
            asyncio.get_running_loop().remove_reader(pipe.fileno())
            ended.set_result(None)

    asyncio.get_running_loop().add_reader(pipe.fileno(), answer)
    pipe.send(url)
    running = asyncio.ensure_future(done)
    await ended
    running.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await running


def bare(pipe: Pipe) -> None:
    """A server of `websockets` alone, in the cheaper of the two ways of its documentation.

    One task sends to everybody 60 times a second with `broadcast`, which waits for nobody, as ours
    does; a producer task for each connection costs half as much again. The path of a connection is
    the size of its patches in bytes.
    """
    patches: dict[ServerConnection, bytes] = {}

    async def handle(ws: ServerConnection) -> None:
        assert ws.request is not None
        patches[ws] = bytes(int(ws.request.path[1:]))
        newest: dict[ServerConnection, str | bytes] = {}
        with contextlib.suppress(ConnectionClosed):
            async for message in ws:
                newest[ws] = message
        del patches[ws]

    async def produce() -> None:
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            for ws, patch in list(patches.items()):
                broadcast([ws], patch)
            due += PERIOD
            await asyncio.sleep(due - loop.time())

    async def play() -> None:
        async with serve(handle, "127.0.0.1", 0, compression=None) as server:
            port = next(iter(server.sockets)).getsockname()[1]
            await _report(pipe, f"ws://127.0.0.1:{port}", float, produce())

    asyncio.run(play())


def ours(pipe: Pipe, subdivisions: int, still: bool) -> None:
    """Our server with a balloon.

    Args:
        pipe: To whoever measures.
        subdivisions: Subdivisions of the balloon.
        still: Whether the world stands once it has run for `_SETTLE` ticks with the same users: the
            wire alone is left, with real patches.
    """
    spent = 0.0
    whole = Room.tick
    settled: tuple[int, set[int]] = (0, set())

    def tick(room: Room, now: float) -> object:
        nonlocal spent, settled
        start = time.thread_time()
        ticks, users = settled
        settled = (ticks + 1 if users == set(room.members) else 0, set(room.members))
        if still and ticks > _SETTLE:
            room.patches = {u: replace(p, tick=p.tick + 1) for u, p in room.patches.items()}
        else:
            whole(room, now)
        spent += time.thread_time() - start
        return room.patches

    Room.tick = tick  # type: ignore[method-assign,assignment]
    body = Balloon(BalloonSettings(subdivisions=subdivisions))
    sys.setswitchinterval(5e-4)  # as `cohaptic serve` has it

    async def play() -> None:
        server = CohapticServer(body, ServerSettings(port=0, max_users=MAX_USERS))
        url = await server.start()
        await _report(pipe, url, lambda: spent, server.run())

    with threadpool_limits(limits=1):
        asyncio.run(play())
