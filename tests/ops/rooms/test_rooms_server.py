"""A server with several rooms, whose processes are stopped, killed and slow."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys
from collections.abc import AsyncGenerator, Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from cohaptic.control.law import Law
from cohaptic.errors import CloseCode
from cohaptic_ops.rooms import room_supervisor as keeping
from cohaptic_ops.rooms.config import RoomsConfig, RoomTable
from cohaptic_ops.rooms.process.room_process import Build
from cohaptic_ops.rooms.rooms_server import RoomsServer
from tests.ops.monitoring.asking import ask, status_once
from tests.ops.rooms.bodies import slow, small, torn
from tests.patience import PATIENCE
from tests.server.peers import hello_text
from tests.server.shell.stage import Client, names, visit

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="hands sockets over"),
]

PRESSING = (0.09, 0.0, 0.0)


@dataclass
class Served:
    """A server with rooms that are open or broken."""

    rooms_server: RoomsServer
    url: str

    def at(self, room: str) -> str:
        return f"{self.url}/r/{room}"

    def pid(self, room: str) -> int:
        process = self.rooms_server.supervisors[room].process
        assert process is not None
        assert process.pid is not None
        return process.pid

    def is_new(self, room: str, pid: int) -> bool:
        """Whether a room has another process than that one, and it has started."""
        process = self.rooms_server.supervisors[room].process
        return process is not None and process.pid not in (None, pid)

    def signal(self, room: str, number: signal.Signals) -> None:
        os.kill(self.pid(room), number)

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(PATIENCE):
            while not condition():
                await asyncio.sleep(0.02)


@contextlib.asynccontextmanager
async def served(
    rooms: Mapping[str, Build],
    tables: dict[str, dict[str, Any]] | None = None,
    soon: dict[str, float] | None = None,
    **more: Any,
) -> AsyncGenerator[Served]:
    own = tables or {}
    table = {name: RoomTable(body="balloon", **own.get(name, {})) for name in rooms}
    config = RoomsConfig(port=0, rooms=table, **more)
    # Nobody of a test has the patience that a file has to ask for.
    table = {name: room.model_copy(update=soon) for name, room in table.items()} if soon else table
    config = config.model_copy(update={"rooms": table})
    rooms_server = RoomsServer(config, rooms)
    try:
        async with asyncio.timeout(PATIENCE):
            url = await rooms_server.start()
        yield Served(rooms_server, url)
    finally:
        await rooms_server.drain()


@dataclass
class Visitor:
    """One who presses in a room, and comes back whenever the connection is lost.

    Attributes:
        ticks: Times of all patches so far [s], on the clock of the room.
        closed: Codes and reasons of the connections that have ended.
    """

    url: str
    name: str = field(default_factory=lambda: next(names))
    ticks: list[float] = field(default_factory=list[float])
    closed: list[tuple[int | None, str]] = field(default_factory=list[tuple[int | None, str]])

    def has_ticks(self, least: int) -> bool:
        return len(self.ticks) > least

    async def live(self) -> None:
        while True:
            with contextlib.suppress(OSError, InvalidHandshake, TimeoutError):
                async with visit(self.url, patience=10.0) as client:
                    with contextlib.suppress(ConnectionClosed):
                        await self._press(client)
                    self.closed.append((client.ws.close_code, client.ws.close_reason or ""))
            await asyncio.sleep(0.05)

    async def _press(self, client: Client) -> None:
        await client.join(self.name)
        client.probe, client.force = PRESSING, (2.0, 0.0, 0.0)
        while True:
            self.ticks += [patch.t_server for patch in await client.play(1)]


@contextlib.asynccontextmanager
async def visitors(house: Served, *rooms: str) -> AsyncGenerator[list[Visitor]]:
    there = [Visitor(house.at(room)) for room in rooms]
    living = [asyncio.ensure_future(visitor.live()) for visitor in there]
    try:
        for visitor in there:
            await house.until(partial(visitor.has_ticks, 10))
        yield there
    finally:
        for task in living:
            task.cancel()
        await asyncio.gather(*living, return_exceptions=True)


def reported(house: Served, room: str) -> tuple[int, int]:
    """Ticks of a room since its start, and how many of them it missed, as it reports them."""
    report = house.rooms_server.supervisors[room].report
    return (0, 0) if report is None else (report.ticks, report.missed)


@pytest.mark.alone
def test_a_room_goes_on_beside_a_slow_one_and_a_stopped_one() -> None:
    """How many ticks it keeps then is for `benchmarks/bad_neighbours.py` to say."""

    async def main() -> None:
        rooms = {"slow": slow, "stopped": small, "third": small}
        async with served(rooms, lease=30.0) as house, visitors(house, *rooms):
            house.signal("stopped", signal.SIGSTOP)
            # One who comes to the stopped room waits; who asks for the others does not.
            _, writer = await asyncio.open_connection(*address(house.url))
            writer.write(b"GET /r/stopped/ HTTP/1.1\r\nHost: localhost\r\n\r\n")
            (stopped, _), (third, _) = reported(house, "stopped"), reported(house, "third")
            # It really is slow: with a tick of 30 ms it misses some of 60 a second.
            await house.until(lambda: reported(house, "slow")[1] > 10)
            await house.until(lambda: reported(house, "third")[0] > third + 120)
            assert reported(house, "stopped")[0] <= stopped + 60  # what it had yet to report
            house.signal("stopped", signal.SIGCONT)
            writer.close()

    asyncio.run(main())


def address(url: str) -> tuple[str, int]:
    host, _, port = url.removeprefix("ws://").rpartition(":")
    return host, int(port)


def test_a_room_that_is_killed_comes_back_with_its_users_and_no_other_notices() -> None:
    async def main() -> None:
        rooms = {"killed": small, "other": small}
        async with served(rooms) as house, visitors(house, "killed", "other") as (one, other):
            supervisor, pid = house.rooms_server.supervisors["killed"], house.pid("killed")
            before = len(one.ticks)
            house.signal("killed", signal.SIGKILL)
            await house.until(lambda: len(one.closed) > 0 and len(one.ticks) > before + 30)
            assert one.closed[0] == (1006, "")
            assert other.closed == []
            assert house.pid("killed") != pid
            assert supervisor.restarts.count == 1
            # Whoever had a connection is counted out, and the one who came back is counted in.
            sources = house.rooms_server.limiter.sources
            await house.until(lambda: sources.open == 2)

    asyncio.run(main())


def test_a_room_that_says_nothing_for_too_long_is_started_again() -> None:
    async def main() -> None:
        async with served({"main": small}, lease=2.0) as house, visitors(house, "main") as (one,):
            pid, before = house.pid("main"), len(one.ticks)
            house.signal("main", signal.SIGSTOP)
            await house.until(lambda: house.is_new("main", pid) and len(one.ticks) > before + 30)

    asyncio.run(main())


def test_what_is_full_broken_or_not_there_is_said_and_costs_the_others_nothing() -> None:
    async def main() -> None:
        rooms = {"main": small, "torn": torn}
        tables = {"main": {"max_users": 1, "laws": (Law.PREDICTIVE,)}}
        async with served(rooms, tables) as house, visitors(house, "main"):
            supervisors = house.rooms_server.supervisors
            assert (supervisors["torn"].state, supervisors["torn"].problem) == (
                "broken",
                "the mesh is torn",
            )
            for room, code, words in (
                ("main", CloseCode.ROOM_FULL, "number of users is 2; expected at most 1; you can"),
                ("none", CloseCode.NO_ROOM, "there is no room none here; there are: main, torn"),
                ("torn", CloseCode.SERVER_STOPS, "the room torn is broken"),
            ):
                code_got, reason = await refused(house.at(room))
                assert code_got == code.value
                assert reason.startswith(words)
            await house.until(lambda: house.rooms_server.states()[0].state == "full")

    asyncio.run(main())


async def refused(url: str) -> tuple[int, str]:
    async with visit(url) as client:
        with contextlib.suppress(ConnectionClosed):
            await client.ws.send(hello_text(next(names)))
        return (await client.end())[:2]


def test_rooms_share_the_seats_of_the_server_and_one_that_empties_gives_them_back() -> None:
    async def main() -> None:
        async with served({"a": small, "b": small}, max_users=2) as house:
            users = house.rooms_server.users
            await house.until(lambda: users["a"].held == users["b"].held == 1)
            async with visitors(house, "a"):
                code, reason = await refused(house.at("a"))
                assert code == CloseCode.ROOM_FULL.value
                assert "the other rooms of this server have its other seats" in reason
                async with visitors(house, "b"):
                    pass
            async with visitors(house, "b"):
                await house.until(lambda: users["a"].held + users["b"].held <= 2)

    asyncio.run(main())


ON_DEMAND = {"start": "on demand"}


def test_a_room_on_demand_has_a_process_while_somebody_is_there() -> None:
    async def main() -> None:
        rooms, tables = {"rare": small, "main": small}, {"rare": ON_DEMAND, "main": ON_DEMAND}
        async with served(rooms, tables, {"end_after": 0.5}, lease=2.0, max_users=1) as house:
            supervisors = house.rooms_server.supervisors
            assert [one.state for one in house.rooms_server.states()] == ["idle", "idle"]
            assert supervisors["rare"].process is None
            pids = list[int]()
            for _ in range(2):
                # The only seat of the server is that of the room that somebody is in.
                async with visitors(house, "rare"):
                    pids.append(house.pid("rare"))
                    assert supervisors["main"].process is None
                    # Longer than it would be empty for.
                    await asyncio.sleep(1.2)
                    assert house.pid("rare") == pids[-1]
                await house.until(lambda: supervisors["rare"].state == "idle")
                await house.until(lambda: not supervisors["rare"].runs)
                with pytest.raises(ProcessLookupError):
                    os.kill(pids[-1], 0)
            assert pids[0] != pids[1]
            assert supervisors["rare"].restarts.count == 0
            assert house.rooms_server.limiter.sources.open == 0

    asyncio.run(main())


def test_whoever_comes_while_a_room_ends_is_in_the_next_one() -> None:
    async def main() -> None:
        # It ends at each look that finds nobody, a quarter of a second apart.
        async with served({"main": small}, {"main": ON_DEMAND}, {"end_after": 0.0}, lease=2.0) as h:
            ends = set[int]()
            supervisor = h.rooms_server.supervisors["main"]
            for step in range(12):
                async with visit(h.at("main"), patience=PATIENCE) as client:
                    await client.join(next(names))
                    ends.add(h.pid("main"))
                if step % 2:
                    # In the very moment in which it is told to end.
                    await h.until(lambda: supervisor.state == "idle")
            assert len(ends) > 3

    asyncio.run(main())


def has_ended(supervisor: keeping.RoomSupervisor, times: int) -> bool:
    return supervisor.restarts.count == times


def test_a_server_that_stops_tells_everybody_and_leaves_no_process() -> None:
    async def main() -> None:
        async with served({"a": small, "b": small}) as house:
            pids = [house.pid(room) for room in ("a", "b")]
            async with visitors(house, "a", "b") as there:
                await house.rooms_server.drain()
                await house.until(lambda: all(visitor.closed for visitor in there))
                for visitor in there:
                    assert visitor.closed[0][0] == CloseCode.SERVER_STOPS.value
                    assert "stops" in visitor.closed[0][1]
        for pid in pids:
            with pytest.raises(ProcessLookupError):
                os.kill(pid, 0)

    asyncio.run(main())


def test_the_admin_port_tells_of_every_room_of_one_that_is_stopped_and_of_the_end() -> None:
    async def run() -> None:
        async with served(
            {"main": small, "other": small, "torn": torn}, admin={"port": 0}, lease=60.0
        ) as house:
            admin = house.rooms_server.admin
            assert admin is not None
            ready = await status_once(admin.url, lambda reported: bool(reported["ready"]))
            states = {room["name"]: room["state"] for room in ready["rooms"]}
            assert states == {"main": "open", "other": "open", "torn": "broken"}
            house.signal("other", signal.SIGSTOP)
            reported = await status_once(
                admin.url, lambda reported: not reported["rooms"][1]["ticking"]
            )
            house.signal("other", signal.SIGCONT)
            assert reported["ready"]
            assert reported["rooms"][0]["ticking"]
            await status_once(admin.url, lambda reported: bool(reported["rooms"][1]["ticking"]))
            code, text = await ask(f"{admin.url}/metrics")
            assert code == 200
            assert b'cohaptic_room_ticking{room="main"} 1.0' in text
            assert b'cohaptic_ticks_total{room="other"}' in text
            house.rooms_server.draining = True
            await status_once(
                admin.url, lambda reported: reported["reasons"] == ["the server is draining"]
            )

    asyncio.run(run())
