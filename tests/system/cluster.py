"""Three machines that share twelve rooms, with hands in each, and all that befalls them."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import urllib.request
from collections.abc import AsyncGenerator, Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Self

from websockets.exceptions import ConnectionClosed, InvalidHandshake

from cohaptic.clock import SystemClock
from tests.patience import PATIENCE
from tests.server.shell.stage import visit
from tests.system.namespaces import Machine

CLOCK = SystemClock()
ROOMS = tuple(f"room{k}" for k in range(12))
PORT, ENGINE, _ADMIN = 8765, 6399, 9100
_PRESSING = (0.09, 0.0, 0.0)
_RECENT = 0.5  # s since the last patch of a hand that touches
_SILENT = 2.0  # s without a patch until a hand comes again
RATE = 30.0  # ticks a second: three machines of twelve rooms have to do with the cores of one
_OPEN = re.compile(r"room (room\d+) is open, process (\d+)")


def configuration(machines: Sequence[Machine]) -> str:
    """Of the rooms, the same on all machines, which are all witnesses."""
    addresses = ", ".join(f'"{one.address}"' for one in machines)
    rooms = "".join(
        f'[rooms.{room}]\nbody = "balloon"\nrate = {RATE}\nstart = "on demand"\ncores = 0.1\n'
        f'limits = {{beats = "2000:2000"}}\n'  # benchmarks/cluster.py measures by pings
        for room in ROOMS
    )
    return (
        f'host = "0.0.0.0"\nport = {PORT}\nallow_hosts = [{addresses}]\n'
        f'[admin]\nport = {_ADMIN}\nhost = "0.0.0.0"\n'
        f"[access]\nopen = true\ninsecure = true\n[cluster]\nwitnesses = [{addresses}]\n{rooms}"
    )


@dataclass
class Hand:
    """One who presses in a room, and comes again through the next machine if nothing is heard.

    Attributes:
        patches: Times at which patches came [s].
        lost: Times at which connections ended [s].
    """

    room: str
    name: str
    through: int
    urls: Sequence[str]
    patches: list[float] = field(default_factory=list[float])
    lost: list[float] = field(default_factory=list[float])

    @property
    def touches(self) -> bool:
        return bool(self.patches) and CLOCK.now() - self.patches[-1] < _RECENT

    def silence(self, begin: float, end: float) -> float:
        """The longest time without a patch [s]."""
        times = [begin, *(at for at in self.patches if begin < at < end), end]
        return max(b - a for a, b in pairwise(times))

    async def live(self) -> None:
        while True:
            url = f"{self.urls[self.through]}/r/{self.room}"
            # A room keeps the name of a lost connection for a moment, and then says so: no welcome.
            with contextlib.suppress(OSError, InvalidHandshake, ConnectionClosed, AssertionError):
                async with visit(url, patience=1e6, open_timeout=2.0, close_timeout=0.1) as client:
                    try:
                        await client.join(self.name)
                        client.probe, client.force = _PRESSING, (2.0, 0.0, 0.0)
                        try:
                            while True:
                                async with asyncio.timeout(_SILENT):
                                    await client.play(1)
                                self.patches.append(CLOCK.now())
                        finally:
                            self.lost.append(CLOCK.now())
                    finally:
                        # A machine that is gone takes no goodbye, for which a close would wait.
                        client.ws.transport.abort()
            self.through = (self.through + 1) % len(self.urls)
            await asyncio.sleep(0.1)


@dataclass(frozen=True)
class Cost:
    """What a failure cost.

    Args:
        silent: Longest silence of each hand in the rooms that it befell [s].
        others: The same of the other hands [s].
        lost: Number of connections that the other hands lost.
    """

    silent: tuple[float, ...]
    others: tuple[float, ...]
    lost: int


@dataclass
class Cluster:
    """The servers of all machines, and the hands."""

    machines: Sequence[Machine]
    folder: Path
    in_each: int = 1  # hands in each room; a busy machine has not the time for many
    servers: dict[int, subprocess.Popen[bytes]] = field(
        default_factory=dict[int, "subprocess.Popen[bytes]"]
    )
    hands: list[Hand] = field(default_factory=list[Hand])

    def __enter__(self) -> Self:
        for k in range(len(self.machines)):
            self.start(k)
        return self

    def __exit__(self, *_: object) -> None:
        for k in self.servers:
            self.terminate(k)
        for server in self.servers.values():
            server.wait(PATIENCE)

    def start(self, k: int) -> None:
        """The server of a machine; the first has the engine's head."""
        config = self.machines[k].folder / "rooms.toml"
        config.write_text(configuration(self.machines))
        command = self.machines[k].command(
            sys.executable, "-m", "cohaptic", "serve", "--config", str(config),
            "--cluster", f"{self.machines[0].address}:{ENGINE}",
        )  # fmt: skip
        with self.log(k).open("ab") as log:
            self.servers[k] = subprocess.Popen(command, stdout=log, stderr=log)

    @property
    def urls(self) -> list[str]:
        """Of all machines."""
        return [f"ws://{one.address}:{PORT}" for one in self.machines]

    def terminate(self, k: int) -> None:
        """Tell the server of a machine to end; `servers[k]` waits for it."""
        for pid in self._with_word(k, b"serve"):
            if Path(f"/proc/{pid}/comm").read_text().strip() not in ("sh", "unshare"):
                os.kill(pid, signal.SIGTERM)

    def log(self, k: int) -> Path:
        return self.folder / f"server{k}.log"

    def rooms(self, k: int) -> dict[str, int]:
        """The processes of the rooms on a machine, by room."""
        living = self.machines[k].numbered()
        # A number may be of a later process there, after the machine was lost.
        reported = self.log(k).read_text().rpartition("listening ")[2]
        found = {room: living.get(int(pid), 0) for room, pid in _OPEN.findall(reported)}
        return {room: pid for room, pid in found.items() if pid and lives(pid)}

    def place(self) -> dict[str, int]:
        """The machine of each room; fails where a room has two."""
        found = dict[str, int]()
        for k in range(len(self.machines)):
            for room in self.rooms(k):
                assert room not in found, f"{room} is on two machines"
                found[room] = k
        return found

    def fullest(self, among: Iterable[int]) -> int:
        """The machine with most rooms."""
        return max(among, key=lambda k: len(self.rooms(k)))

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(PATIENCE):
            while not condition():
                self._none_has_failed()
                await asyncio.sleep(0.05)

    def _none_has_failed(self) -> None:
        failed = [k for k, server in self.servers.items() if server.poll()]
        assert not failed, self.log(failed[0]).read_text()[-2000:]

    async def until_all_touch(self) -> None:
        await self.until(lambda: all(hand.touches for hand in self.hands))

    @contextlib.asynccontextmanager
    async def with_hands(self) -> AsyncGenerator[None]:
        """All hands, which touch."""
        urls = self.urls
        self.hands = [
            Hand(room, f"hand{k}-{j}", (k + j) % len(urls), urls)
            for k, room in enumerate(ROOMS)
            for j in range(self.in_each)
        ]
        living = [asyncio.ensure_future(hand.live()) for hand in self.hands]
        try:
            await self.until_all_touch()
            yield
        finally:
            for task in living:
                task.cancel()
            await asyncio.gather(*living, return_exceptions=True)
            await asyncio.sleep(0.1)  # a connection that was cut in its handshake ends a turn later

    def others(self, rooms: Iterable[str], machine: int = -1) -> list[Hand]:
        """Hands that are in none of these rooms, and have not come through this machine."""
        befallen = set(rooms)
        return [h for h in self.hands if h.room not in befallen and h.through != machine]

    async def cost(self, rooms: Iterable[str], begin: float, others: Sequence[Hand]) -> Cost:
        """What has befallen these rooms, and other hands, since a time; once all touch again."""
        await self.until_all_touch()
        end, befallen = CLOCK.now(), set(rooms)
        return Cost(
            tuple(sorted(h.silence(begin, end) for h in self.hands if h.room in befallen)),
            tuple(sorted(hand.silence(begin, end) for hand in others)),
            sum(at > begin for hand in others for at in hand.lost),
        )

    async def until_joined(self, machines: Iterable[int]) -> None:
        """Until the engine runs on these machines, and can have told its head so."""
        for k in machines:
            async with asyncio.timeout(PATIENCE):
                while not await asyncio.to_thread(self._is_joined, k):
                    self._none_has_failed()
                    await asyncio.sleep(0.2)

    def _is_joined(self, k: int) -> bool:
        """Whether a server has spoken with the engine, as it does through that of its machine."""
        url = f"http://{self.machines[k].address}:{_ADMIN}/status"
        with contextlib.suppress(OSError), urllib.request.urlopen(url, timeout=2.0) as reported:
            cluster = json.load(reported)["cluster"]  # null before its first report
            return cluster is not None and cluster["engine"] is True
        return False

    def start_head(self) -> None:
        """Let the server of the first machine start the engine again."""
        for pid in self._with_word(0, b"cohaptic_ops.cluster.machine"):
            os.kill(pid, signal.SIGCONT)

    def end_head(self) -> None:
        """Kill the engine on the first machine, and keep the server there from noticing it."""
        for pid in self._with_word(0, b"cohaptic_ops.cluster.machine"):
            os.kill(pid, signal.SIGSTOP)
        for pid in [*self._named(0, "gcs_server"), *self._named(0, "raylet")]:
            with contextlib.suppress(OSError):
                os.kill(pid, signal.SIGKILL)

    def _with_word(self, k: int, word: bytes) -> list[int]:
        found = list[int]()
        for pid in self.machines[k].pids():
            with contextlib.suppress(OSError):
                if word in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0"):
                    found.append(pid)
        return found

    def _named(self, k: int, name: str) -> list[int]:
        found = list[int]()
        for pid in self.machines[k].pids():
            with contextlib.suppress(OSError):
                if Path(f"/proc/{pid}/comm").read_text().strip() == name:
                    found.append(pid)
        return found


def lives(pid: int) -> bool:
    """Whether a process is there, and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
