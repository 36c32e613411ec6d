"""The process that rooms are forked from is killed."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from pathlib import Path

import pytest

from cohaptic_ops.rooms.process.starter import can_fork
from tests.ops.rooms.bodies import small
from tests.ops.rooms.test_rooms_server import Served, served

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform != "linux" or not can_fork(), reason="looks into /proc"),
]


def parent(pid: int) -> int:
    """Of a process."""
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])


def has_ended(pid: int) -> bool:
    """Whether a process runs no more; whoever inherits it may not have looked yet."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except OSError:
        return True


def starters() -> set[int]:
    """Processes of this one from which rooms are forked."""
    found = set[int]()
    for place in Path("/proc").glob("[0-9]*"):
        try:
            line = (place / "cmdline").read_bytes()
            if b"forkserver" in line and parent(int(place.name)) == os.getpid():
                found.add(int(place.name))
        except OSError:
            continue
    return found


async def kill_starter(rooms: Served) -> int:
    """Returns the number of its successor, once there is one."""
    old = parent(rooms.pid("a"))
    assert old in starters()
    os.kill(old, signal.SIGKILL)
    await rooms.until(lambda: bool(starters() - {old}))
    (new,) = starters() - {old}
    return new


def test_it_has_a_successor_before_any_room_needs_one() -> None:
    async def play() -> None:
        async with served({"a": small, "b": small}) as rooms:
            before = [rooms.pid("a"), rooms.pid("b")]
            new = await kill_starter(rooms)
            assert [rooms.pid("a"), rooms.pid("b")] == before
            assert {state.state for state in rooms.rooms_server.states()} == {"open"}
            rooms.signal("a", signal.SIGKILL)
            await rooms.until(lambda: rooms.is_new("a", before[0]))
            assert parent(rooms.pid("a")) == new
            assert rooms.pid("b") == before[1]
            # That one may end as well.
            await kill_starter(rooms)

    asyncio.run(play())


def test_a_room_that_hangs_is_ended_though_the_process_that_forked_it_is_gone() -> None:
    async def play() -> None:
        async with served({"a": small, "b": small}, lease=2.0) as rooms:
            await kill_starter(rooms)
            a, b = rooms.pid("a"), rooms.pid("b")
            rooms.signal("a", signal.SIGKILL)
            await rooms.until(lambda: rooms.is_new("a", a))
            rooms.signal("b", signal.SIGSTOP)
            try:
                await rooms.until(lambda: rooms.is_new("b", b))
                assert has_ended(b)
            finally:
                if not has_ended(b):
                    os.kill(b, signal.SIGKILL)

    asyncio.run(play())
