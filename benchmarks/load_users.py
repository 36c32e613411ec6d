"""The users of `load.py`, in a process of their own, and the bare server beside ours."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import select
import struct
import time
from dataclasses import dataclass, field
from multiprocessing.connection import Connection as Pipe

from websockets.asyncio.server import ServerConnection, broadcast, serve
from websockets.exceptions import ConnectionClosed

from cohaptic.runtime.scheduling import SERVER_PRIORITY, prefer_this_process
from core_users import PERIOD, Count, User

JOINING = 15.0  # s for all users of a scene to come in; later ones are left out, and told of
T_SERVER = 12  # bytes before the time of its tick, in a patch


@dataclass
class RoomCount(Count):
    """Patches of one room, and when its ticks were.

    Attributes:
        ticks: Times of its ticks on the server's clock, each once [s].
    """

    ticks: list[float] = field(default_factory=list[float])

    def add(self, came: bytes, at: int, length: int) -> None:
        """Count a patch."""
        super().add(came, at, length)
        (t,) = struct.unpack_from("<d", came, at + T_SERVER)
        if not self.ticks or t > self.ticks[-1]:
            self.ticks.append(t)


def crowd(cores: set[int], pipe: Pipe) -> None:
    """Main function of the process: play each scene that the pipe orders.

    Args:
        cores: That it may run on.
        pipe: A scene is a list of addresses and a list with the number of users of each. `True` is
            answered by what came since the last: patches and bytes, times of ticks for each
            address, the processor time of this process so far, and the words to each user who was
            closed; `False` ends the scene.
    """
    os.sched_setaffinity(0, cores)
    with contextlib.suppress(EOFError, ConnectionError):  # whoever measures has gone
        while True:
            play(pipe, *pipe.recv())


# One loop over all users of a scene, from their coming to their leaving.
def play(pipe: Pipe, urls: list[str], users: list[int]) -> None:
    """Play so many users at each address until the other end says so, and tell their counts."""
    counts = [RoomCount() for _ in urls]
    until = time.perf_counter() + JOINING
    everybody: list[tuple[User, RoomCount]] = []
    closed: list[str] = []
    gone: set[User] = set()  # who was closed; the others go on
    for url, count, here in zip(urls, counts, users, strict=True):
        for i in range(here):
            patience = until - time.perf_counter()
            if patience <= 0.0:  # a server that has no time left answers nobody in any
                closed.append(f"{url}: not asked any more after {JOINING:g} s")
                continue
            try:
                user = User(url, "plane", "press", 0.0, 2.0 * math.pi * i / here, i, patience)
            except (OSError, AssertionError) as error:
                closed.append(f"{url}: {error}")
            else:
                everybody.append((user, count))
    poll = select.epoll()
    by_file = {user.socket.fileno(): (user, count) for user, count in everybody}
    for file in (*by_file, pipe.fileno()):
        poll.register(file, select.EPOLLIN)
    start, sent, many = time.perf_counter() + PERIOD, 0, max(1, len(everybody))

    def end(user: User, error: Exception) -> None:
        poll.unregister(user.socket.fileno())
        closed.append(f"{error}: {user.last_words!r}")
        user.socket.close()
        gone.add(user)

    while True:
        due = start + sent * PERIOD / many
        for file, _ in poll.poll(max(0.0, due - time.perf_counter())):
            if file != pipe.fileno():
                user, count = by_file[file]
                if user not in gone:
                    try:
                        user.read(count)
                    except OSError as error:
                        end(user, error)
            elif pipe.recv():
                came = [(c.patches, c.size, c.ticks) for c in counts]
                pipe.send((came, time.process_time(), closed))
                for count in counts:
                    count.patches = count.size = 0
                    count.ticks = []
            else:
                for user, _ in everybody:
                    user.leave()
                return
        now = time.perf_counter()
        # One that was held up leaves samples out, as a client does.
        sent = max(sent, int((now - start - 4.0 * PERIOD) / PERIOD * many))
        while start + sent * PERIOD / many <= now:
            for user, _ in everybody[sent % many : sent % many + 1]:
                if user not in gone:
                    try:
                        user.write(now - start)
                    except OSError as error:
                        end(user, error)
            sent += 1


def bare(cores: set[int], pipe: Pipe) -> None:
    """A server of `websockets` alone that takes samples and sends as many bytes at the same rate.

    It goes before ordinary processes, as our rooms do: else whatever runs beside would be measured.

    Args:
        cores: That it may run on.
        pipe: To which it says where it is, and its processor time whenever it is asked.
    """
    os.sched_setaffinity(0, cores)
    prefer_this_process(SERVER_PRIORITY)
    sizes: dict[ServerConnection, int] = {}
    newest: dict[ServerConnection, str | bytes] = {}

    async def handle(ws: ServerConnection) -> None:
        assert ws.request is not None
        sizes[ws] = int(ws.request.path[1:])
        with contextlib.suppress(ConnectionClosed):
            async for message in ws:
                newest[ws] = message
        del sizes[ws]

    async def produce() -> None:
        due = time.perf_counter()
        while True:
            now = time.perf_counter()
            patches = {
                size: bytes(T_SERVER) + struct.pack("<d", now) + bytes(size - T_SERVER - 8)
                for size in set(sizes.values())
            }
            for ws, size in list(sizes.items()):
                broadcast([ws], patches[size])
            due += PERIOD
            # As ours: of ticks that are overdue one is done, and the others are left out.
            due += PERIOD * max(0.0, (time.perf_counter() - due) // PERIOD)
            await asyncio.sleep(max(0.0, due - time.perf_counter()))

    async def play() -> None:
        loop, ended = asyncio.get_running_loop(), asyncio.Event()

        def answer() -> None:
            try:
                pipe.recv()
                pipe.send(time.process_time())
            except (EOFError, ConnectionError):
                loop.remove_reader(pipe.fileno())
                ended.set()

        async with serve(handle, "127.0.0.1", 0, compression=None) as server:
            loop.add_reader(pipe.fileno(), answer)
            pipe.send(f"ws://127.0.0.1:{next(iter(server.sockets)).getsockname()[1]}")
            producing = asyncio.ensure_future(produce())
            await ended.wait()
            producing.cancel()

    asyncio.run(play())
