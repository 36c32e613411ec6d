"""One node of a cluster: it owns rooms by leases, finds those of others, and may be a witness."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import socket
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Final

from cohaptic.clock import Clock
from cohaptic.errors import SettingError
from cohaptic_ops.cluster.addresses import host_of
from cohaptic_ops.cluster.callers import Caller
from cohaptic_ops.cluster.engine import Engine
from cohaptic_ops.cluster.leases import NEVER, Claims, Witness
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
from cohaptic_ops.cluster.places import PLACING, Places, share_out
from cohaptic_ops.monitoring.json_lines import BadLine
from cohaptic_ops.monitoring.metrics import ClusterHealth

log = logging.getLogger("cohaptic.server")

_ASKS: Final = 6  # questions to a witness in a term
_LOOK_EVERY: Final = 0.1  # s between two looks at what is owned; a lost room ends as late as this
_BEAT: Final = 1.0  # s between two words to the machine's program
_FOUND_WITHIN: Final = 4.0  # s for which somebody waits for a room without an owner
_KNOWN_FOR: Final = 0.5  # s for which the place of a room is not looked up again
# Longest time for which a room that another node has, or wants too, is not wanted again [s]; many
# times as long as a question and its answer.
_STEP_BACK: Final = 0.3


@dataclass(frozen=True, slots=True)
class NodeHooks:
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
class _Sought:
    """A room that somebody wants to go to.

    Attributes:
        found: Event that is set when it is found.
        there: Place of the room, once it is found.
        waiting: Number of people who wait.
    """

    found: asyncio.Event = field(default_factory=asyncio.Event)
    there: There | None = None
    waiting: int = 0


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
        hooks: What the node wants of its server.
        clock: The machine's clock, which the rooms' processes read too.
        processors: Number of processors of this machine.
    """

    address: str
    witnesses: tuple[str, ...]
    witness: bool
    term: float
    engine: Engine
    places: Places
    hooks: NodeHooks
    clock: Clock
    processors: float
    found: Mapping[str, There] = field(default_factory=dict[str, There])

    def __post_init__(self) -> None:
        now = self.clock.now()
        self._name = f"{self.address}.{secrets.token_hex(8)}"
        self._claims = Claims(len(self.witnesses), self.term)
        self._witness: Witness | None = None
        if self.witness:
            self._witness = Witness([*self.places.cores, PLACING], self.term, now)
        self._people: dict[str, tuple[int, int]] = {}  # as owners tell this witness
        self._nodes: dict[str, tuple[float, float]] = {}  # their processors, and when they said so
        self._freed: dict[str, tuple[int, float]] = {}
        self._leaves = False
        self._beat = now
        self._not_before: dict[str, float] = {}
        self._sought: dict[str, _Sought] = {}
        self._known: dict[str, tuple[There, float]] = {}
        self._lists = False
        self._begun, self._heard = now, [NEVER] * len(self.witnesses)
        self._silent: set[str] | None = None
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
                lambda: Caller(self.answer, self.take), host.strip("[]"), int(port)
            )
        except OSError as error:
            limit = f"an address of this machine with a free port: {error.strerror}"
            raise SettingError("cluster.port", self.address, limit) from error
        work = [self._ask_on(k) for k in range(len(self.witnesses))]
        work += [self._look_on(), self.engine.keep()]
        self._tasks = [asyncio.ensure_future(one) for one in work]

    def health(self, passed: int) -> ClusterHealth:
        """Return the state of this machine in the cluster.

        Args:
            passed: Number of connections that are passed on.
        """
        now = self.clock.now()
        return ClusterHealth(
            machine=self.address,
            witnesses=len(self.witnesses),
            answering=self._answering(now),
            owned=sum(self.owns(room) for room in self._claims.asked if room != PLACING),
            passed=passed,
            engine=self.engine.reached if self.witness else None,
            decides=self.owns(PLACING),
        )

    def _answering(self, now: float) -> int:
        """Return the number of witnesses that have answered lately."""
        return sum(now - at <= self.term for at in self._heard)

    def _max_answer(self) -> bool:
        return 2 * self._answering(self.clock.now()) > len(self.witnesses)

    async def run(self) -> None:
        """Wait for ever; raise the error of a part of the node that has failed."""
        await asyncio.gather(*self._tasks)

    def pause(self) -> None:
        """Ask and look no more, as a process that is stopped; for tests and experiments."""
        for task in self._tasks:
            task.cancel()

    async def leave(self) -> None:
        """Take no more rooms, and let the engine place none here; the rooms go on."""
        self._leaves = True
        await self.engine.leave()

    async def stop(self) -> None:
        """Give back all rooms, which must have ended, and leave the cluster."""
        self._leaves = True
        for room in self._claims.asked:
            self.release(room)
        await asyncio.sleep(2.0 * _LOOK_EVERY)  # the witnesses are told
        self.pause()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self.engine.stop()
        if self._server is not None:
            self._server.close()

    def owns(self, room: str) -> bool:
        """Whether this node owns a room now."""
        return self._claims.epoch(room, self.clock.now()) is not None

    def release(self, room: str) -> None:
        """Give back a room that has ended here."""
        self._claims.drop(room)
        self._freed[room] = self._claims.last(room), self.clock.now()
        self._speak()

    async def listed(self) -> Mapping[str, There]:
        """Return the places of all rooms that have an owner, a moment old."""
        self._lists = True
        self._speak()
        await asyncio.sleep(2.0 * _LOOK_EVERY)
        return self.found if self._max_answer() else {}

    async def find(self, room: str) -> There | None:
        """Return the place of a room, which gets one if nobody owns it; None after some seconds."""
        there, at = self._known.get(room, (None, 0.0))
        if there is not None and self.clock.now() - at < _KNOWN_FOR:
            return there
        sought = self._sought.setdefault(room, _Sought())
        sought.waiting += 1
        self._speak()
        try:
            async with asyncio.timeout(_FOUND_WITHIN):
                await sought.found.wait()
            return sought.there
        except TimeoutError:
            return None
        finally:
            sought.waiting -= 1
            if not sought.waiting and self._sought.get(room) is sought:
                del self._sought[room]

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
                enters = self.owns(room) and self.hooks.enter(source)
                if enters and self.hooks.take(connection, room, source):
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
        if epoch == words.epoch and self.hooks.enter(words.source):
            with contextlib.suppress(OSError):
                connection.send(ACCEPTED)  # before the room can write
            self.hooks.take(connection, words.room, words.source)

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
        self._nodes[ask.address] = ask.processors, now
        placed = [
            room
            for room in self._placed(witness, ask.address, now)
            if witness.owner(room, now) is None and self.places.is_wanted(room, now)
        ]
        return Answer(
            granted=granted, refused=refused, placed=tuple(placed), found=found, listed=ask.lists
        )

    def _placed(self, witness: Witness, address: str, now: float) -> Collection[str]:
        """Return the rooms whose place is a node; without the engine, witnesses choose it."""
        if not self.engine.away or witness.owner(PLACING, now) is not None:
            return self.engine.on(host_of(address))
        if witness.silent(now):
            return ()
        owned, nodes = witness.owned(now), self._nodes.items()
        vacant = self.places.sought(now) - owned.keys()
        hooks = {node: count for node, (count, at) in nodes if now - at < self.term / 2.0}
        shares = share_out(vacant, hooks, owned, self.places.cores)
        return [room for room, chosen in shares.items() if chosen == address]

    def _speak(self) -> None:
        for event in self._hurry:
            event.set()

    def _ask(self) -> Ask:
        owned = [room for room in self._claims.asked if room != PLACING and self.owns(room)]
        takes_rooms = not self._leaves and self._max_answer()
        return Ask(
            owner=self._name,
            address=self.address,
            rooms=self._claims.asked,
            freed={room: epoch for room, (epoch, _) in self._freed.items()},
            people={room: self.hooks.people(room) for room in owned},
            finds=tuple(self._sought),
            lists=self._lists,
            processors=self.processors if takes_rooms else 0.0,
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
                            self._heard[k] = self.clock.now()
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
                sought = self._sought.pop(room)
                sought.there = there
                sought.found.set()
        if answer.listed:
            self.found, self._lists = answer.found, False
        self._settle(now)

    def _want(self, room: str, now: float) -> None:
        known = room == PLACING or room in self.places.cores
        if self._leaves or not known or room in self._claims.asked:
            return
        if now >= self._not_before.get(room, now):
            self._claims.want(room, now)
            self._speak()  # somebody waits for the room

    def _settle(self, now: float) -> None:
        gained, lost, failed = self._claims.settle(now)
        for room in failed:
            self._freed[room] = self._claims.last(room), now
        for room in (*lost, *failed):
            self._not_before[room] = now + _STEP_BACK * secrets.randbelow(1000) / 1000.0
        for room in lost:
            if room != PLACING:
                reported = {"event": "room_lost", "room": room}
                words = "room %s ends here: most witnesses grant it to this machine no more"
                log.warning(words, room, extra=reported)
                self.hooks.leave(room)
        for room in gained:
            if self._leaves:
                self.release(room)
            elif room != PLACING:
                self.hooks.host(room)
                self.hooks.owns(room, self._claims.until(room))

    def _tell_witnesses(self, now: float) -> None:
        """Log which witnesses answer, when that changes."""
        heard = zip(self.witnesses, self._heard, strict=True)
        silent = {name for name, at in heard if now - at > self.term}
        starts = self._silent is None and now - self._begun < self.term
        if silent != self._silent and not (starts and silent):
            self._silent, count = silent, len(self.witnesses)
            answer = f"{count - len(silent)} of {count} witnesses answer"
            if silent:
                missing = ", ".join(sorted(silent))
                reported = {"event": "witness_lost"}
                log.warning("%s; silent: %s", answer, missing, extra=reported)
            else:
                log.info("%s", answer, extra={"event": "witness_back"})

    def look(self) -> None:
        """Do what time alone makes due: end lost rooms, tell others for how long they may run."""
        now = self.clock.now()
        self._tell_witnesses(now)
        self.engine.tell()
        self._settle(now)
        freed = self._freed.items()
        self._freed = {room: one for room, one in freed if now - one[1] < self.term}
        nodes = self._nodes.items()
        self._nodes = {node: reported for node, reported in nodes if now - reported[1] < self.term}
        if now - self._beat > _BEAT:
            self._beat = now
            self.engine.beat()
        for room in self._claims.asked:
            if room != PLACING and self.owns(room):
                self.hooks.owns(room, self._claims.until(room))
        if self._sought:
            self._speak()
        witness = self._witness
        if witness is not None and not self.engine.reached:
            if PLACING in self._claims.asked:
                self.release(PLACING)
        elif witness is not None:
            self._want(PLACING, now)
            if self.owns(PLACING):
                owned = witness.owned(now)
                for command in self.places.commands(self.engine.placed, owned, now):
                    self.engine.command(command)

    async def _look_on(self) -> None:
        while True:
            self.look()
            await asyncio.sleep(_LOOK_EVERY)
