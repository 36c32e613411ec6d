"""The people in the queue before a full room: their places are told, and they are called. No I/O.

A place is given up by leaving, and with the connection. Another connection of the same person, by
its secret or its session, takes the place over.
"""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic.errors import CloseCode, ProtocolError, RemoteProtocolError
from cohaptic.protocol.messages import Called, Hello, Place
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.seats.names import Claim
from cohaptic_server.room.seats.wait_queue import TURN
from cohaptic_server.room.session import ServerSession

# s after which a place is told again: a client that hears nothing cannot tell a server that lets it
# wait from one that is gone.
REPEAT = 2.0


@dataclass(eq=False, slots=True)
class _Waiter:
    """One of them.

    Args:
        peer: Who it is.
        session: Of it.
        hello: With which it came.
        told: Its place and their number, as it knows them; None before it was told any.
        told_at: When it was told [s].
    """

    peer: Peer
    session: ServerSession
    hello: Hello
    told: tuple[int, int] | None = None
    told_at: float = 0.0

    def is_due(self, place: tuple[int, int], now: float) -> bool:
        """Whether it is to be told; what it does not take is not said twice."""
        repeated = now - self.told_at >= REPEAT and self.session.outbox.empty
        return self.told != place or repeated

    @property
    def claim(self) -> Claim:
        """To its name."""
        return Claim(self.hello.key, self.peer.source, self.peer.guest.session)


class Waiting:
    """Of one room.

    Args:
        room: That is full; its `queue` is changed here alone.
    """

    def __init__(self, room: Room) -> None:
        self._room = room
        self._waiters: dict[int, _Waiter] = {}
        self._next = 1

    def __len__(self) -> int:
        return len(self._waiters)

    def enter(self, peer: Peer, session: ServerSession, hello: Hello, outcome: Outcome) -> None:
        """Take a place for one who found the room full.

        Args:
            peer: Who it is.
            session: Of it.
            hello: With which it came.
            outcome: To which the tasks of the shell are added.

        Raises:
            RemoteProtocolError: No place is left, or somebody waits by that name.
        """
        waiter, number = _Waiter(peer, session, hello), self._next
        before = next((k for k, w in self._waiters.items() if w.hello.name == hello.name), None)
        if before is None:
            self._room.queue = self._room.queue.enter(number, peer.source)
        else:
            other = self._waiters[before]
            if not other.claim.is_of(waiter.claim):
                limit = "another one: somebody waits by that name"
                raise RemoteProtocolError("name", hello.name, limit, CloseCode.NAME_TAKEN)
            limit = "its only connection: it has come back with another"
            other.session.fail(ProtocolError("user", hello.name, limit))
            outcome.flush.append(other.peer)
            self._room.queue = self._room.queue.hand_on(before, number)
            del self._waiters[before]
        self._next += 1
        self._waiters[number] = waiter
        session.queue()
        outcome.say("waits", f"{hello.name} waits for a place", peer.source, user=hello.name)
        if before is not None and number not in self._room.queue.told():
            self._call(waiter, outcome)  # as the connection before was

    def called(self, peer: Peer) -> Hello | None:
        """The hello of one who says that it comes, and whose turn it is; its place is free then."""
        number = self._number(peer)
        if number is None or number in self._room.queue.told():
            return None
        return self._take_out(number).hello

    def leave(self, peer: Peer) -> bool:
        """Give up the place of a connection that has ended; returns whether it had one."""
        number = self._number(peer)
        if number is not None:
            self._take_out(number)
        return number is not None

    def step(self, now: float, outcome: Outcome) -> None:
        """Call who has a seat now, end whose turn is over, and tell places; at every tick."""
        if not self._waiters:
            return
        for number in self._room.queue.late(now):
            waiter = self._take_out(number)
            limit = f"said within {TURN:g} s: the place went to the next"
            error = RemoteProtocolError("come", "not said", limit, CloseCode.ROOM_FULL)
            waiter.session.fail(error)
            outcome.flush.append(waiter.peer)
        for number in [k for k, w in self._waiters.items() if w.session.close is not None]:
            self._take_out(number)  # its connection has not ended yet
        for number in self._room.call(now):
            self._call(self._waiters[number], outcome)
        for number, place in self._room.queue.told().items():
            waiter = self._waiters[number]
            if waiter.is_due(place, now):
                waiter.told, waiter.told_at = place, now
                waiter.session.send(Place(place=place[0], of=place[1]))
                outcome.flush.append(waiter.peer)

    def _call(self, waiter: _Waiter, outcome: Outcome) -> None:
        waiter.session.send(Called(within=TURN))
        outcome.flush.append(waiter.peer)

    def _number(self, peer: Peer) -> int | None:
        return next((k for k, w in self._waiters.items() if w.peer is peer), None)

    def _take_out(self, number: int) -> _Waiter:
        self._room.queue = self._room.queue.leave(number)
        return self._waiters.pop(number)
