"""A server with four rooms under everything that happens to one, from a seed.

    python benchmarks/soak.py [--minutes 10] [--seed 1] [--people 16] [--step 0.35] [--json FILE]

Users join, leave, vanish, stall, come back and choose other laws; watchers come who acknowledge
nothing; others send rubbish; two `cohaptic touch` are killed with SIGKILL and held up by SIGSTOP;
the processes of two of the rooms are killed, and held up, and come back. Every minute, and at the
end, everybody goes: then nobody may be left, every room has to be open and to tick, and the memory
of the processes that were never killed is taken. The first quarter is warm-up. It ends with status
1 if anything of that does not hold, if memory grew by more than 5 % or if the server's log has a
traceback.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Coroutine
from pathlib import Path
from statistics import median

import json_report
from cohaptic.control.law import Law
from cohaptic_tools.demo.processes import Process
from soak_people import Count, Person, do_harm, watch
from soak_server import ROOMS, STORMY, Server

HZ = 20.0  # samples a second of each user: the machine is for the server
STEP = 0.35  # s between two happenings
# Draws of the first happenings, so that also a short time has one of each kind: two native clients
# and users come, one watches, one does harm, one stalls, and so on; the last are kills or halts.
OPENING = (
    *2 * (0.96,), *4 * (0.1,), 0.93, 0.9, 0.65, 0.82, 0.75, *3 * (0.99,), 0.55, 0.55, *3 * (0.96,),
)  # fmt: skip
EVERY = 60.0  # s between two looks with nobody there
SOON = 40.0  # s in which everybody has gone, and every room is open
GROWTH = 0.05  # of memory after warm-up


class Storm:
    """What happens, from a seed.

    Args:
        server: To whom.
        people: How many users there are at most.
        seed: Seed of the order of events.
        folder: For logs.
    """

    def __init__(self, server: Server, people: int, seed: int, folder: Path) -> None:
        self.server, self.count = server, Count()
        self._limit, self._folder = people, folder
        self._draw = random.Random(seed)
        self._people: list[Person] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self._native: list[Process] = []
        self._stopped: list[tuple[float, int]] = []
        self._numbers = itertools.count()
        self._opening = list(reversed(OPENING))
        self.kills = self.native_kills = 0

    @property
    def opens(self) -> bool:
        """Whether not all of the first happenings have been."""
        return bool(self._opening)

    def happen(self) -> None:
        """One event."""
        draw, now = self._draw, time.monotonic()
        self._go_on(now)
        kind = self._opening.pop() if self._opening else draw.random()
        if len(self._people) < self._limit and kind < 0.5:
            room = self.server.room(draw.choice(ROOMS))
            self._people.append(Person(room, HZ, self.count, draw.randrange(2**32)))
        elif kind < 0.62 and self._people:
            one = self._people.pop(draw.randrange(len(self._people)))
            one.go(politely=draw.random() < 0.5)
            self._keep(one.task)
        elif kind < 0.72 and self._people:
            draw.choice(self._people).stall(draw.uniform(0.2, 6.0))
        elif kind < 0.79 and self._people:
            draw.choice(self._people).come_back()
        elif kind < 0.84 and self._people:
            draw.choice(self._people).choose(draw.choice([Law.PREDICTIVE, Law.PI]))
        elif kind < 0.92:
            room = self.server.room(draw.choice(ROOMS))
            self._begin(do_harm(room, self.count, draw.randrange(2**32)))
        elif kind < 0.95:
            self._begin(watch(self.server.room(draw.choice(ROOMS)), self.count, draw.uniform(1, 8)))
        elif kind < 0.98:
            self._disturb_native(now)
        else:
            self._disturb_room(now)

    def _disturb_native(self, now: float) -> None:
        draw = self._draw
        if len(self._native) < 2:
            number = next(self._numbers)
            self._native.append(
                Process(
                    "touch",
                    self.server.url,
                    "--room",
                    draw.choice(ROOMS),
                    "--name",
                    f"n{number}",
                    "--json-lines",
                    log=self._folder / f"n{number}.log",
                )
            )
        elif draw.random() < 0.5:
            one = self._native.pop(0)
            with contextlib.suppress(ProcessLookupError):
                os.kill(one.pid, signal.SIGKILL)
            one.wait()
            self.native_kills += 1
        else:
            self._hold_up(draw.choice(self._native).pid, now + draw.uniform(0.5, 3.0))

    def _disturb_room(self, now: float) -> None:
        room = self._draw.choice(STORMY)
        if self.server.states()[room][0] not in ("open", "full"):
            return
        if self._draw.random() < 0.5:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.server.pid(room), signal.SIGKILL)
            self.kills += 1
        else:
            self._hold_up(self.server.pid(room), now + self._draw.uniform(0.5, 4.0))

    def _hold_up(self, pid: int, until: float) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGSTOP)
            self._stopped.append((until, pid))

    def _go_on(self, now: float) -> None:
        for until, pid in list(self._stopped):
            if until <= now:
                self._stopped.remove((until, pid))
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGCONT)

    def _begin(self, doing: Coroutine[None, None, None]) -> None:
        self._keep(asyncio.ensure_future(doing))

    def _keep(self, task: asyncio.Task[None]) -> None:
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def everybody_goes(self) -> None:
        """All of them, half without a word."""
        self._go_on(float("inf"))
        people, self._people = self._people, []
        for i, one in enumerate(people):
            one.go(politely=i % 2 == 0)
        native, self._native = self._native, []
        for process in native:
            await asyncio.to_thread(process.wait)
        await asyncio.gather(*(one.task for one in people), *self._tasks)

    async def look(self) -> tuple[dict[str, int], list[str]]:
        """Memory with nobody there, and what is wrong then."""
        await self.everybody_goes()
        wrong: list[str] = []

        def empty() -> bool:
            return all(state == ("open", 0) for state in self.server.states().values())

        if not await soon(empty):
            wrong.append(f"a ghost, or a room that is stuck: {self.server.states()}")
        guests = [Person(self.server.room(room), HZ, self.count, 0) for room in ROOMS]
        first = [0] * len(guests)

        def tick() -> bool:
            for i, guest in enumerate(guests):
                first[i] = first[i] or guest.ticks
            return all(guest.ticks > one > 0 for guest, one in zip(guests, first, strict=True))

        if not await soon(tick):
            stuck = [r for r, g, one in zip(ROOMS, guests, first, strict=True) if g.ticks <= one]
            wrong.append(f"no patches from {', '.join(stuck)}")
        for guest in guests:
            guest.go(politely=True)
        await asyncio.gather(*(guest.task for guest in guests))
        return self.server.memory(), wrong


async def soon(condition: Callable[[], bool]) -> bool:
    """Whether it comes to hold."""
    end = time.monotonic() + SOON
    while not condition():
        if time.monotonic() > end:
            return False
        await asyncio.sleep(0.25)
    return True


async def play(
    storm: Storm, seconds: float, every: float, step: float
) -> tuple[list[dict[str, int]], list[str]]:
    """The whole of it: memory at each look, and what was wrong."""
    memories: list[dict[str, int]] = []
    wrong: list[str] = []
    start = time.monotonic()
    next_look = start + max(every, step * len(OPENING))
    while time.monotonic() < start + seconds or storm.opens:
        storm.happen()
        await asyncio.sleep(step)
        # Not among the first happenings, however slow the machine: they are to be of each kind.
        if not storm.opens and time.monotonic() >= min(next_look, start + seconds):
            memory, found = await storm.look()
            memories.append(memory)
            wrong += found
            said = " ".join(f"{name} {size / 1e6:.1f}" for name, size in memory.items())
            print(f"{time.monotonic() - start:6.0f} s  {said} MB  {storm.count}", flush=True)
            next_look = time.monotonic() + every
    return memories, wrong


def growth(memories: list[dict[str, int]]) -> dict[str, float]:
    """Growth of each process after the first quarter: last third over first third, less one."""
    settled = memories[len(memories) // 4 :]
    third = max(1, len(settled) // 3)
    grown: dict[str, float] = {}
    for name in memories[0]:
        early, late = (
            median(memory[name] for memory in part) for part in (settled[:third], settled[-third:])
        )
        grown[name] = late / early - 1.0
    return grown


def main() -> None:
    """Play, print and judge."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--people", type=int, default=16)
    parser.add_argument("--step", type=float, default=STEP, help="s between two happenings")
    options = parser.parse_args()
    seconds = 60.0 * options.minutes
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        server = Server(folder)
        storm = Storm(server, options.people, options.seed, folder)
        try:
            every = min(EVERY, seconds / 4.0)
            memories, wrong = asyncio.run(play(storm, seconds, every, options.step))
        finally:
            server.process.wait()
        wrong += [f"log: {line}" for line in server.faults()]
        lines = len(server.log.read_text().splitlines())
    grown = growth(memories)
    wrong += [f"{name} grew by {100 * g:.1f} %" for name, g in grown.items() if g > GROWTH]
    row: dict[str, float | int] = {
        "seconds": seconds,
        **vars(storm.count),
        "rooms_killed": storm.kills,
        "clients_killed": storm.native_kills,
        "log_lines": lines,
        "looks": len(memories),
        **{f"growth_{name}": g for name, g in grown.items()},
        **{f"memory_{name}_bytes": size for name, size in memories[-1].items()},
        "wrong": len(wrong),
    }
    print("\n".join(f"{name} {value:.4g}" for name, value in row.items()))
    print("\n".join(wrong) or "nothing was wrong")
    json_report.write(options, [row])
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
