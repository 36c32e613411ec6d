"""Three nodes over loopback, with an engine that places a room where fewest are."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import sys
from collections.abc import AsyncGenerator, Callable, Mapping
from dataclasses import dataclass, field
from typing import cast

import pytest

from cohaptic.clock import SystemClock
from cohaptic_ops.cluster.addresses import host_port
from cohaptic_ops.cluster.engine import Engine
from cohaptic_ops.cluster.lines import Command, Pass
from cohaptic_ops.cluster.node import Node, NodeHooks
from cohaptic_ops.cluster.passing import pass_on
from cohaptic_ops.cluster.places import Places
from tests.patience import PATIENCE

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform != "linux", reason="has one loopback address only"),
]

HOSTS = ("127.0.0.1", "127.0.0.2", "127.0.0.3")
ROOMS = tuple(f"room{k}" for k in range(6))
TERM = 1.5


@dataclass
class _Placing:
    """An engine without programs: it places a room at once, on a machine that is there."""

    there: list[str]
    placed: dict[str, str] = field(default_factory=dict[str, str])
    reached: bool = True

    @property
    def away(self) -> bool:
        return not self.reached

    def on(self, host: str) -> list[str]:
        return [room for room, machine in self.placed.items() if machine == host]

    def command(self, command: Command) -> None:
        if command.place:
            fewest = min(self.there, key=list(self.placed.values()).count)
            self.placed[command.place] = command.at or fewest
        self.placed.pop(command.remove, None)

    def lose(self, host: str) -> None:
        self.there.remove(host)
        for room, machine in self.placed.items():
            if machine == host:
                self.placed[room] = min(self.there, key=list(self.placed.values()).count)

    async def keep(self) -> None:
        await asyncio.Event().wait()

    async def leave(self) -> None:
        pass

    async def stop(self) -> None:
        pass

    def beat(self) -> None:
        pass

    def tell(self) -> None:
        pass


class _Echo(asyncio.Protocol):
    """The end of a connection in a room: it says what it hears."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)

    def data_received(self, data: bytes) -> None:
        self._transport.write(data)


@dataclass
class _Server:
    """The server of a node, whose rooms echo."""

    hosts: list[str] = field(default_factory=list[str])
    until: dict[str, float] = field(default_factory=dict[str, float])
    entered: list[str] = field(default_factory=list[str])
    ends: set[asyncio.Task[object]] = field(default_factory=set[asyncio.Task[object]])

    def take(self, connection: socket.socket, room: str, _source: str) -> bool:
        loop = asyncio.get_running_loop()
        if room in self.hosts:
            work = loop.connect_accepted_socket(_Echo, connection.dup())
            self.ends.add(asyncio.ensure_future(work))
        return room in self.hosts

    def enter(self, source: str) -> bool:
        self.entered.append(source)
        return source != "unwelcome"

    def here(self) -> NodeHooks:
        return NodeHooks(
            self.hosts.append, self.hosts.remove, self.until.__setitem__, self.enter, self.take,
            lambda _room: (2, 1),
        )  # fmt: skip


@dataclass
class _Cluster:
    engine: _Placing
    nodes: Mapping[str, Node]
    servers: Mapping[str, _Server]

    def owners(self, room: str) -> list[str]:
        return [host for host, node in self.nodes.items() if node.owns(room)]

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(PATIENCE):
            while not condition():
                await asyncio.sleep(0.02)
                assert all(len(self.owners(room)) <= 1 for room in ROOMS)


@contextlib.asynccontextmanager
async def _cluster(always: tuple[str, ...] = ROOMS) -> AsyncGenerator[_Cluster]:
    engine, clock = _Placing(list(HOSTS)), SystemClock()
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    servers = {host: _Server() for host in HOSTS}
    nodes = {
        host: Node(
            host_port(host, port), tuple(host_port(one, port) for one in HOSTS), True, TERM,
            cast(Engine, engine),
            Places(dict.fromkeys(ROOMS, 0.1), always), servers[host].here(), clock, 1.0,
        )
        for host in HOSTS
    }  # fmt: skip
    for node in nodes.values():
        await node.start()
    try:
        yield _Cluster(engine, nodes, servers)
    finally:
        for node in nodes.values():
            await node.stop()


async def _visit(node: Node, room: str, source: str = "198.51.100.7") -> socket.socket:
    """Return the visitor's end of a connection that this node passes on."""
    with socket.create_server(("127.0.0.1", 0)) as acceptor:
        ours = socket.create_connection(acceptor.getsockname())
        theirs, _ = acceptor.accept()
    ours.setblocking(False)
    theirs.setblocking(False)
    _PASSING.add(asyncio.ensure_future(node.pass_on(theirs, room, source)))
    return ours


_PASSING: set[asyncio.Task[bool]] = set()


async def _echoed(connection: socket.socket, data: bytes) -> bytes:
    loop, heard = asyncio.get_running_loop(), bytearray()
    sending = asyncio.ensure_future(loop.sock_sendall(connection, data))
    async with asyncio.timeout(PATIENCE):
        while len(heard) < len(data):
            more = await loop.sock_recv(connection, 1 << 16)
            if not more:
                break
            heard += more
    sending.cancel()
    return bytes(heard)


def test_each_room_has_one_owner_and_a_visitor_reaches_it_through_every_node() -> None:
    async def main() -> None:
        async with _cluster() as there:
            await there.until(lambda: all(there.owners(room) for room in ROOMS))
            assert {len(server.hosts) for server in there.servers.values()} == {2}
            for node in there.nodes.values():
                for room in ROOMS:
                    with await _visit(node, room) as visitor:
                        assert await _echoed(visitor, room.encode()) == room.encode()
            listed = await there.nodes[HOSTS[1]].listed()
            assert {(one.users, one.watchers) for one in listed.values()} == {(2, 1)}
            assert set(listed) == set(ROOMS)
            entered = [name for server in there.servers.values() for name in server.entered]
            assert set(entered) == {"198.51.100.7"}

    asyncio.run(main())


def test_much_that_nobody_reads_waits_with_its_writer_and_comes_whole() -> None:
    async def main() -> None:
        async with _cluster(ROOMS[:1]) as there:
            await there.until(lambda: bool(there.owners(ROOMS[0])))
            other = next(host for host in HOSTS if host not in there.owners(ROOMS[0]))
            with await _visit(there.nodes[other], ROOMS[0]) as visitor:
                much = bytes(range(256)) * 8_000
                assert await _echoed(visitor, much) == much

    asyncio.run(main())


def test_a_room_that_rests_stays_away_until_somebody_comes() -> None:
    async def main() -> None:
        async with _cluster(()) as there:
            with await _visit(there.nodes[HOSTS[2]], ROOMS[3]) as visitor:
                assert await _echoed(visitor, b"hello") == b"hello"
            (owner,) = there.owners(ROOMS[3])
            for node in there.nodes.values():
                node.places.wanted.clear()  # long ago
            there.servers[owner].hosts.remove(ROOMS[3])
            there.nodes[owner].release(ROOMS[3])
            await there.until(lambda: ROOMS[3] not in there.engine.placed)
            assert all(server.hosts == [] for server in there.servers.values())

    asyncio.run(main())


def test_witnesses_place_rooms_while_the_engine_is_away_and_tell_it_when_it_is_back() -> None:
    async def main() -> None:
        async with _cluster() as there:
            await there.until(lambda: all(there.owners(room) for room in ROOMS))
            there.engine.reached = False
            await there.until(lambda: not any(node.owns("*") for node in there.nodes.values()))
            there.nodes[HOSTS[0]].pause()
            left = there.servers[HOSTS[1]].hosts, there.servers[HOSTS[2]].hosts
            await there.until(lambda: {*left[0], *left[1]} == set(ROOMS))
            there.engine.placed.clear()
            there.engine.reached = True
            await there.until(lambda: set(there.engine.placed) == set(ROOMS))
            assert all(room in there.servers[at].hosts for room, at in there.engine.placed.items())

    asyncio.run(main())


def test_a_node_that_hears_nothing_loses_its_rooms_before_another_has_them() -> None:
    async def main() -> None:
        async with _cluster() as there:
            await there.until(lambda: all(there.owners(room) for room in ROOMS))
            lost = there.nodes[HOSTS[0]]
            lost.pause()
            there.engine.lose(HOSTS[0])
            # `until` looks at each moment that a room has at most one owner.
            others = there.servers[HOSTS[1]].hosts, there.servers[HOSTS[2]].hosts
            await there.until(lambda: len(others[0]) == len(others[1]) == 3)
            assert there.owners(ROOMS[0]) != [HOSTS[0]]
            # When it wakes up, it gives its rooms up.
            lost.look()
            assert there.servers[HOSTS[0]].hosts == []

    asyncio.run(main())


def test_a_connection_for_an_older_owner_or_of_one_without_budget_is_not_taken() -> None:
    async def main() -> None:
        async with _cluster(ROOMS[:1]) as there:
            await there.until(lambda: bool(there.owners(ROOMS[0])))
            (host,) = there.owners(ROOMS[0])
            node = there.nodes[host]
            found = await node.find(ROOMS[0])
            assert found is not None
            with socket.socket() as connection:
                for room, epoch, source in (
                    (ROOMS[0], found.epoch - 1, "welcome"),
                    (ROOMS[0], found.epoch, "unwelcome"),
                    (ROOMS[1], found.epoch, "welcome"),
                ):
                    words = Pass(room=room, epoch=epoch, source=source)
                    assert not await pass_on(connection, found.address, words)

    asyncio.run(main())


def test_a_node_hears_rubbish_closes_that_connection_and_goes_on() -> None:
    async def main() -> None:
        async with _cluster() as there:
            await there.until(lambda: all(there.owners(room) for room in ROOMS))
            host, _, port = there.nodes[HOSTS[0]].address.rpartition(":")
            for rubbish in (b"GET / HTTP/1.1\r\n\r\n", b'{"kind":"answer"}\n', b"\x00" * (1 << 21)):
                reader, writer = await asyncio.open_connection(host, int(port))
                writer.write(rubbish)
                with contextlib.suppress(ConnectionError):
                    assert await asyncio.wait_for(reader.read(), PATIENCE) == b""
                writer.close()
            assert all(there.owners(room) for room in ROOMS)

    asyncio.run(main())
