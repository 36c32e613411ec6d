"""Tells the people in the queue for a full room their places, and calls them. No I/O.

A person who leaves, or whose connection ends, loses the place. Another connection of the same
person, recognised by secret or session, gets the place.
"""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic.errors import CloseCode, ProtocolError, RemoteProtocolError
from cohaptic.protocol.messages import Called, Hello, Place
from cohaptic_server.room.life import Event
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.seats.names import Claim, looks_like
from cohaptic_server.room.seats.wait_queue import TURN
from cohaptic_server.room.session import ServerSession

# s after which a client is told its place again: a client that hears nothing cannot distinguish a
# server that lets it wait from a server that is gone.
REPEAT = 2.0


@dataclass(eq=False, slots=True)
class _Waiter:
    """A client that waits for a seat.

    Args:
        hello: First message of the client; a `set_name` replaces the name in it.
        token: Token with which the client can come back; None if the client needs no token, or
            after the token was sent.
        reported: Place and number of places in the client's last message; None before the first
            message.
        told_at: Time at which that message was queued [s].
    """

    peer: Peer
    session: ServerSession
    hello: Hello
    token: str | None = None
    reported: tuple[int, int] | None = None
    reported_at: float = 0.0

    @property
    def claim(self) -> Claim:
        return Claim(self.hello.key, self.peer.source, self.peer.guest.session)

    def tell(self, place: tuple[int, int], now: float, outcome: Outcome) -> None:
        """Send the client its place if the place has changed, or if `REPEAT` has passed since."""
        # A client that has not taken the last message is not told again.
        repeated = now - self.reported_at >= REPEAT and self.session.outbox.empty
        if self.reported == place and not repeated:
            return
        if self.reported is not None and self.session.outbox.empty:
            self.token = None  # the message with the token was sent, and no newer one replaced it
        self.reported, self.reported_at = place, now
        self.session.send(Place(place=place[0], of=place[1], session=self.token))
        outcome.flush.append(self.peer)


class Waiting:
    """Clients that wait for a seat in one room.

    Args:
        room: The full room; this class changes the room's `queue`.
    """

    def __init__(self, room: Room) -> None:
        self._room = room
        self._waiters: dict[int, _Waiter] = {}
        self._next = 1

    def __len__(self) -> int:
        return len(self._waiters)

    def check_name(self, name: str, claim: Claim) -> None:
        """Raise RemoteProtocolError if another client waits under a name that looks like this one.

        Args:
            name: Name that a client wants.
            claim: Claim of that client to the name.
        """
        others = [w for w in self._waiters.values() if looks_like(w.hello.name, name)]
        if not all(waiter.claim.is_of(claim) for waiter in others):
            limit = "another one: somebody who waits for a seat has it"
            raise RemoteProtocolError("name", name, limit, CloseCode.NAME_TAKEN)

    def has_name(self, name: str, peer: Peer) -> bool:
        """Whether a client other than `peer` waits under a name, or one that looks like it."""
        others = [w for w in self._waiters.values() if w.peer is not peer]
        return any(looks_like(waiter.hello.name, name) for waiter in others)

    def enter(
        self,
        peer: Peer,
        session: ServerSession,
        hello: Hello,
        token: str | None,
        now: float,
        outcome: Outcome,
    ) -> None:
        """Add a client that found the room full to the queue.

        Args:
            peer: Client that waits.
            session: Protocol session of the client.
            hello: First message of the client; no other client waits under its name. If the same
                session waits under another name, this client gets that place.
            token: Token with which the client can come back; None if the client needs no token.
            now: Time [s].
            outcome: Receives the tasks of the shell.

        Raises:
            RemoteProtocolError: The queue is full, or the client's address has too many places.
        """
        waiter, number = _Waiter(peer, session, hello, token), self._next
        before = self._of(hello.name, waiter.claim)
        if before:
            self._room.queue = self._room.queue.hand_on(before[0], number)
        else:
            self._room.queue = self._room.queue.enter(number, peer.source, now)
        self._take_over(before, outcome)
        self._next += 1
        self._waiters[number] = waiter
        session.queue()
        outcome.say("waits", f"{hello.name} waits for a place", peer.source, user=hello.name)
        turn = self._room.queue.turn_of(number)
        if turn is not None:
            self._call(waiter, turn - now, outcome)  # since the previous connection was called

    def called(self, peer: Peer) -> Hello | None:
        """Take a called client out of the queue; return its hello, None if it was not called."""
        number = self._number(peer)
        if number is None or self._room.queue.turn_of(number) is None:
            return None
        self._room.queue = self._room.queue.come(number)
        return self._waiters.pop(number).hello

    def hello_of(self, peer: Peer) -> Hello | None:
        """Return the hello of a client that waits; None for a client that does not wait."""
        number = self._number(peer)
        return None if number is None else self._waiters[number].hello

    def rename(self, peer: Peer, name: str) -> None:
        """Change the name of a waiting client; the caller ensures that nobody else has the name."""
        for waiter in self._waiters.values():
            if waiter.peer is peer:
                waiter.hello = waiter.hello.model_copy(update={"name": name})

    def take_in(self, name: str, claim: Claim, outcome: Outcome) -> None:
        """End the waiting connections of a client that has got a seat with another connection."""
        self._take_over(self._of(name, claim), outcome)

    def leave(self, peer: Peer, now: float) -> str | None:
        """Remove an ended connection from the queue; return its client's name, or None."""
        number = self._number(peer)
        return None if number is None else self._take_out(number, now).hello.name

    def step(self, now: float, outcome: Outcome) -> None:
        """Call clients to free seats, send places, and end the sessions of those that did not come.

        The method is called at every tick.
        """
        if not self._waiters:
            return
        for number in self._room.queue.late(now):
            waiter = self._take_out(number, now)
            limit = f"said within {TURN:g} s: the place went to the next"
            error = RemoteProtocolError("come", "not said", limit, CloseCode.ROOM_FULL)
            waiter.session.fail(error, Event.MISSED)
            outcome.flush.append(waiter.peer)
            name = waiter.hello.name
            sentence = f"{name} was called to a place and did not come"
            outcome.say("missed_its_turn", sentence, waiter.peer.source, user=name)
        for number in [k for k, w in self._waiters.items() if w.session.close is not None]:
            self._take_out(number, now)  # the session has ended, but the connection not yet
        for number in self._room.call(now):
            self._call(self._waiters[number], TURN, outcome)
        for number, place in self._room.queue.ranks().items():
            self._waiters[number].tell(place, now, outcome)

    def _call(self, waiter: _Waiter, within: float, outcome: Outcome) -> None:
        waiter.session.call(Called(within=max(within, 0.001)))
        outcome.flush.append(waiter.peer)
        sentence = f"{waiter.hello.name} is called to a place"
        outcome.say("called", sentence, waiter.peer.source, user=waiter.hello.name)

    def _take_over(self, before: list[int], outcome: Outcome) -> None:
        """End the earlier connections of a client that has come back with another connection."""
        for number in before:
            self._room.queue = self._room.queue.come(number)
            waiter = self._waiters.pop(number)
            limit = "its only connection: it has come back with another"
            error = ProtocolError("user", waiter.hello.name, limit)
            waiter.session.fail(error, Event.REPLACED)
            outcome.flush.append(waiter.peer)

    def _of(self, name: str, claim: Claim) -> list[int]:
        """Return the numbers of clients in the same session, or with a name that looks alike."""
        return [
            number
            for number, waiter in self._waiters.items()
            if looks_like(waiter.hello.name, name) or claim.is_session_of(waiter.claim)
        ]

    def _number(self, peer: Peer) -> int | None:
        return next((k for k, w in self._waiters.items() if w.peer is peer), None)

    def _take_out(self, number: int, now: float) -> _Waiter:
        self._room.queue = self._room.queue.leave(number, now)
        return self._waiters.pop(number)
