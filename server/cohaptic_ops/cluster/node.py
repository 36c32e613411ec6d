"""One node of a cluster: it owns rooms by leases, finds those of others, and may be a witness."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import secrets
import socket
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final, cast

from cohaptic.clock import Clock
from cohaptic.errors import SettingError
from cohaptic_ops.cluster.engine import Engine
from cohaptic_ops.cluster.leases import Claims, Witness
from cohaptic_ops.cluster.lines import (
    ACCEPTED,
    LONGEST,
    Answer,
    Ask,
    Pass,
    There,
    decode,
    encode,
)
from cohaptic_ops.cluster.passing import pass_on
from cohaptic_ops.cluster.places import PLACING, Places
from cohaptic_ops.monitoring.json_lines import BadLine

log = logging.getLogger("cohaptic.server")

_ASKS: Final = 6  # questions to a witness in a term
_LOOK_EVERY: Final = 0.1  # s between two looks at what is owned; a lost room ends as late as this
_FOUND_WITHIN: Final = 4.0  # s for which somebody waits for a room without an owner
_KNOWN_FOR: Final = 0.5  # s for which the place of a room is not looked up again
# Longest time for which a room that another node has, or wants too, is not wanted again [s]; many
# times as long as a question and its answer.
_STEP_BACK: Final = 0.3


def at(host: str, port: int) -> str:
    """Return an address as HOST:PORT, with brackets around an IPv6 host."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def own_address(engine: str) -> str:
    """Return the IP address from which this machine reaches the engine at HOST:PORT.

    Raises:
        SettingError: The engine's address is wrong, or there is no way to it.
    """
    host, _, port = engine.rpartition(":")
    try:
        if not host:
            raise ValueError("no host")
        # Nothing is sent: a datagram socket only looks up the way.
        kind = socket.AF_INET6 if ":" in host else socket.AF_INET
        with socket.socket(kind, socket.SOCK_DGRAM) as probe:
            probe.connect((host.strip("[]"), int(port)))
            return str(probe.getsockname()[0])
    except (OSError, ValueError) as error:
        limit = f"HOST:PORT of the first machine's engine, such as 10.0.0.1:6379 ({error})"
        raise SettingError("--cluster", engine, limit) from error


def is_here(name: str, host: str) -> bool:
    """Whether a name or an address is this machine's.

    Args:
        name: Name or IP address, as the configuration has it.
        host: IP address of this machine.
    """
    if name in (host, socket.gethostname()) or name.partition(".")[0] == socket.gethostname():
        return True
    with contextlib.suppress(OSError):  # a name that nobody knows yet is another machine's
        return host in {str(found[4][0]) for found in socket.getaddrinfo(name, None)}
    return False


@dataclass(frozen=True, slots=True)
class Here:
    """What a node wants of its server; nothing of it may wait.

    Args:
        host: Called with a room that this node has begun to own.
        leave: Called with a room that it owns no more, and that must end now.
        owns: Called with a room and the time until which it may run, on the machine's clock [s].
        enter: Called with the source of a connection that another node passes on; returns whether
            its rate limits allow the connection.
        take: Called with such a connection, the room and the source; returns whether the room takes
            it over.
        people: Returns the numbers of users and watchers in a room.
    """

    host: Callable[[str], None]
    leave: Callable[[str], None]
    owns: Callable[[str, float], None]
    enter: Callable[[str], bool]
    take: Callable[[socket.socket, str, str], bool]
    people: Callable[[str], tuple[int, int]]


@dataclass
class Node:
    """A node of a cluster.

    Args:
        address: Address at which other nodes reach this one, HOST:PORT.
        witnesses: Addresses of the witnesses, the same on every node; may have names.
        witness: Whether this node is one of them.
        term: Duration of a lease [s].
        engine: The engine.
        places: Places of the rooms, as this node wants them if it decides.
        here: What the node wants of its server.
        clock: The machine's clock, which the rooms' processes read too.
    """

    address: str
    witnesses: tuple[str, ...]
    witness: bool
    term: float
    engine: Engine
    places: Places
    here: Here
    clock: Clock
    found: Mapping[str, There] = field(default_factory=dict[str, There])

    def __post_init__(self) -> None:
        now = self.clock.now()
        self._name = f"{self.address}.{secrets.token_hex(8)}"
        self._claims = Claims(len(self.witnesses), self.term)
        self._witness: Witness | None = None
        if self.witness:
            self._witness = Witness([*self.places.cores, PLACING], self.term, now)
        self._people: dict[str, tuple[int, int]] = {}  # as owners tell this witness
        self._freed: dict[str, float] = {}
        self._not_before: dict[str, float] = {}
        self._sought: dict[str, asyncio.Future[There]] = {}
        self._known: dict[str, tuple[There, float]] = {}
        self._lists = False
        self._hurry = [asyncio.Event() for _ in self.witnesses]
        self._server: asyncio.Server | None = None
        self._tasks: list[asyncio.Task[None]] = []

    async def start(self) -> None:
        """Take part in the cluster.

        Raises:
            SettingError: The address is not available.
        """
        loop = asyncio.get_running_loop()
        host, _, port = self.address.rpartition(":")
        try:
            self._server = await loop.create_server(
                lambda: _Caller(self), host.strip("[]"), int(port)
            )
        except OSError as error:
            limit = f"an address of this machine with a free port: {error.strerror}"
            raise SettingError("cluster.address", self.address, limit) from error
        work = [self._ask_on(k) for k in range(len(self.witnesses))]
        work += [self._look_on(), self.engine.keep()]
        self._tasks = [asyncio.ensure_future(one) for one in work]

    async def stop(self) -> None:
        """Give back all rooms, which must have ended, and leave the cluster."""
        for room in self._claims.asked:
            self.release(room)
        await asyncio.sleep(2.0 * _LOOK_EVERY)  # the witnesses are told
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._server is not None:
            self._server.close()

    def owns(self, room: str) -> bool:
        """Whether this node owns a room now."""
        return self._claims.epoch(room, self.clock.now()) is not None

    def release(self, room: str) -> None:
        """Give back a room that has ended here."""
        self._claims.drop(room)
        self._freed[room] = self.clock.now()
        self._speak()

    async def listed(self) -> Mapping[str, There]:
        """Return the places of all rooms that have an owner, a moment old."""
        self._lists = True
        self._speak()
        await asyncio.sleep(2.0 * _LOOK_EVERY)
        return self.found

    async def find(self, room: str) -> There | None:
        """Return the place of a room, which gets one if nobody owns it; None after some seconds."""
        there, at = self._known.get(room, (None, 0.0))
        if there is not None and self.clock.now() - at < _KNOWN_FOR:
            return there
        sought = self._sought.setdefault(room, asyncio.get_running_loop().create_future())
        self._speak()
        try:
            async with asyncio.timeout(_FOUND_WITHIN):
                return await asyncio.shield(sought)
        except TimeoutError:
            self._sought.pop(room, None)
            return None

    async def pass_on(self, connection: socket.socket, room: str, source: str) -> bool:
        """Bring a connection to the node of its room, until it ends; return False if none is found.

        A connection for a room of this node is handed to the room, and this call returns.
        """
        deadline = self.clock.now() + _FOUND_WITHIN
        while self.clock.now() < deadline:
            there = await self.find(room)
            if there is None:
                break
            if there.address == self.address:
                enters = self.owns(room) and self.here.enter(source)
                if enters and self.here.take(connection, room, source):
                    connection.close()
                    return True
            elif await pass_on(
                connection, there.address, Pass(room=room, epoch=there.epoch, source=source)
            ):
                return True
            self._known.pop(room, None)
            await asyncio.sleep(_LOOK_EVERY)
        return False

    def take(self, connection: socket.socket, words: Pass) -> None:
        """Take a connection that another node passes on, or leave it to be closed."""
        epoch = self._claims.epoch(words.room, self.clock.now())
        if epoch == words.epoch and self.here.enter(words.source):
            with contextlib.suppress(OSError):
                connection.send(ACCEPTED)  # before the room can write
            self.here.take(connection, words.room, words.source)

    def answer(self, ask: Ask) -> Answer:
        """Answer a question as a witness; without any grant if this node is none."""
        witness, now = self._witness, self.clock.now()
        if witness is None:
            return Answer()
        witness.free(ask.owner, ask.freed)
        granted, refused = witness.grant(ask.owner, ask.address, ask.rooms, now)
        self._people |= ask.people
        found = dict[str, There]()
        for room in self.places.cores if ask.lists else ask.finds:
            grant = witness.owner(room, now)
            if grant is not None:
                users, watchers = self._people.get(room, (0, 0))
                found[room] = There(
                    address=grant.address, epoch=grant.epoch, users=users, watchers=watchers
                )
        for room in ask.finds:
            self.places.want(room, now)
        host = ask.address.rpartition(":")[0].strip("[]")
        placed = [
            room
            for room, machine in self.engine.placed.items()
            if machine == host and witness.owner(room, now) is None
        ]
        return Answer(
            granted=granted, refused=refused, placed=tuple(placed), found=found, listed=ask.lists
        )

    def _speak(self) -> None:
        for event in self._hurry:
            event.set()

    def _ask(self) -> Ask:
        owned = [room for room in self._claims.asked if room != PLACING and self.owns(room)]
        return Ask(
            owner=self._name,
            address=self.address,
            rooms=self._claims.asked,
            freed=tuple(self._freed),
            people={room: self.here.people(room) for room in owned},
            finds=tuple(self._sought),
            lists=self._lists,
        )

    async def _ask_on(self, k: int) -> None:
        """Ask one witness again and again, until cancelled."""
        host, _, port = self.witnesses[k].rpartition(":")
        every = self.term / _ASKS
        while True:
            with contextlib.suppress(OSError, BadLine, EOFError, asyncio.LimitOverrunError):
                async with asyncio.timeout(every):
                    reader, writer = await asyncio.open_connection(
                        host.strip("[]"), int(port), limit=LONGEST
                    )
                try:
                    while True:
                        self._hurry[k].clear()
                        sent = self.clock.now()
                        writer.write(encode(self._ask()))
                        async with asyncio.timeout(self.term):
                            answer = decode(await reader.readuntil(b"\n"))
                        if isinstance(answer, Answer):
                            self._hear(self.witnesses[k], sent, answer)
                        # Not `wait_for`, which may lose a cancellation.
                        with contextlib.suppress(TimeoutError):
                            async with asyncio.timeout(sent + every - self.clock.now()):
                                await self._hurry[k].wait()
                finally:
                    writer.close()
            await asyncio.sleep(every)

    def _hear(self, witness: str, sent: float, answer: Answer) -> None:
        now, asked = self.clock.now(), self._claims.asked
        self._claims.heard(witness, sent, answer.granted, answer.refused)
        for room in answer.placed:
            self._want(room, now)
        if self._claims.asked != asked:
            self._speak()  # a number was too low
        for room, there in answer.found.items():
            known = self._known.get(room)
            if known is None or there.epoch >= known[0].epoch or now - known[1] > self.term:
                self._known[room] = (there, now)
            if room in self._sought:
                self._sought.pop(room).set_result(there)
        if answer.listed:
            self.found, self._lists = answer.found, False
        self._settle(now)

    def _want(self, room: str, now: float) -> None:
        if room not in self._claims.asked and now >= self._not_before.get(room, now):
            self._freed.pop(room, None)
            self._claims.want(room, now)
            self._speak()  # somebody waits for the room

    def _settle(self, now: float) -> None:
        gained, lost, failed = self._claims.settle(now)
        for room in failed:
            self._freed[room] = now
        for room in (*lost, *failed):
            self._not_before[room] = now + _STEP_BACK * secrets.randbelow(1000) / 1000.0
        for room in lost:
            if room != PLACING:
                told = {"event": "room_lost", "room": room}
                log.warning("room %s belongs to another node now", room, extra=told)
                self.here.leave(room)
        for room in gained:
            if room != PLACING:
                self.here.host(room)
                self.here.owns(room, self._claims.until(room))

    async def _look_on(self) -> None:
        while True:
            now = self.clock.now()
            self._settle(now)
            self._freed = {room: at for room, at in self._freed.items() if now - at < self.term}
            for room in self._claims.asked:
                if room != PLACING and self.owns(room):
                    self.here.owns(room, self._claims.until(room))
            if self._sought:
                self._speak()
            witness = self._witness
            if witness is not None:
                self._want(PLACING, now)
                if self.owns(PLACING) and self.engine.reached:
                    owned = witness.owned(now)
                    for command in self.places.commands(self.engine.placed, owned, now):
                        self.engine.command(command)
            await asyncio.sleep(_LOOK_EVERY)


class _Caller(asyncio.Protocol):
    """A connection of another node: questions, or one connection that it passes on."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._rest = b""
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Store the transport; the event loop calls this at the beginning."""
        self._transport = cast("asyncio.Transport", transport)

    def data_received(self, data: bytes) -> None:
        """Answer the lines of the other node; the event loop calls this."""
        assert self._transport is not None
        *lines, self._rest = (self._rest + data).split(b"\n")
        try:
            if len(self._rest) > LONGEST:
                raise BadLine("a line without an end")
            for line in lines:
                match decode(line):
                    case Ask() as ask:
                        self._transport.write(encode(self._node.answer(ask)))
                    case Pass() as words:
                        self._take(words)
                        return
                    case _:
                        raise BadLine("an answer without a question")
        except BadLine as error:
            log.warning("another node sent a wrong line: %s", error, extra={"event": "bad_node"})
            self._transport.abort()

    def _take(self, words: Pass) -> None:
        """Hand the socket to a room; nothing of the visitor was sent before it is accepted."""
        assert self._transport is not None
        handle: socket.socket = self._transport.get_extra_info("socket")
        self._transport.pause_reading()
        connection = socket.socket(fileno=os.dup(handle.fileno()))
        with connection:
            self._transport.abort()  # closes its own descriptor only
            connection.setblocking(False)
            self._node.take(connection, words)
