"""Queue for a seat in a full room, in the order of arrival; an immutable value.

    enter --> waits --call--> called --come--> in the room
                |               |
                +--- leave      +--- nothing within TURN, or leave: a missed turn ---> out

When a seat is free, the first visitor in the queue is called, and the seat is reserved for that
visitor while the call lasts. Nobody jumps the queue: while somebody waits, all free seats go to the
queue. A called visitor who does not come blocks a seat for `TURN`; the visitor's address may then
have one place less in the queue for `MISSED_FOR`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from cohaptic.errors import CloseCode, RemoteProtocolError

# s that a called visitor has to come. A client answers automatically and at once. A client that
# does not answer blocks a seat for that long, and a path that stalls for longer is as good as lost.
TURN = 5.0
# s for which a missed turn counts as a used place of its address. Otherwise a few addresses that
# never take a seat, and come back at once, would hold the queue for ever.
MISSED_FOR = 60.0
MAX_MISSED = 1024  # missed turns that are remembered; more than the largest room has in MISSED_FOR


@dataclass(frozen=True, slots=True)
class Place:
    """Place of one visitor in the queue.

    Args:
        number: Number by which the caller identifies the visitor.
        source: Network address of the visitor's connection.
        until: Time at which the visitor's turn ends [s]; None before the visitor is called.
    """

    number: int
    source: str
    until: float | None = None


@dataclass(frozen=True, slots=True)
class Missed:
    """A call to a seat that a visitor did not follow in time.

    Args:
        source: Network address of the visitor.
        until: Time until which this address may have one place less in the queue [s].
    """

    source: str
    until: float


@dataclass(frozen=True, slots=True)
class WaitQueue:
    """All visitors who wait for a seat in one room.

    Args:
        limit: Largest number of places; 0 for no queue.
        max_of_source: Largest number of places for one address, so that no address can take the
            whole queue.
        places: Places in the order of arrival.
        missed: Recently missed turns, the oldest first.
    """

    limit: int
    max_of_source: int
    places: tuple[Place, ...] = ()
    missed: tuple[Missed, ...] = ()

    def __len__(self) -> int:
        return len(self.places)

    def __contains__(self, number: int) -> bool:
        return any(place.number == number for place in self.places)

    @property
    def called(self) -> int:
        """Number of visitors who were called and have not come yet; a seat is reserved for each."""
        return sum(place.until is not None for place in self.places)

    def enter(self, number: int, source: str, now: float) -> WaitQueue:
        """Return the queue with one more visitor at the end.

        Args:
            number: Number of the new visitor.
            source: Network address of the visitor's connection.
            now: Time [s].

        Raises:
            RemoteProtocolError: The queue is full, or this address has as many places as it may.
            ValueError: A visitor with this number waits already.
        """
        if number in self:
            raise ValueError(f"{number} waits already")
        of_source = sum(place.source == source for place in self.places)
        ends = [missed.until for missed in self.missed if missed.source == source]
        ends = [end for end in ends if end > now]
        fraction = max(0, self.max_of_source - len(ends))
        why = ", since turns were missed there" if ends else ""
        why += f"; a place more in {ends[0] - now:.0f} s" if ends else ""
        for subject, waiting, limit, words in (
            ("number of people who wait", len(self.places), self.limit, ""),
            ("number of people who wait from one address", of_source, fraction, why),
        ):
            if waiting >= limit:
                raise RemoteProtocolError(
                    subject, waiting + 1, f"at most {limit}{words}", CloseCode.ROOM_FULL, "queue"
                )
        return replace(self, places=(*self.places, Place(number, source)))

    def come(self, number: int) -> WaitQueue:
        """Return the queue without a visitor who takes a seat; unchanged if not in the queue."""
        return replace(self, places=tuple(p for p in self.places if p.number != number))

    def leave(self, number: int, now: float) -> WaitQueue:
        """Return the queue without a visitor who has gone; a called visitor has missed the turn.

        Args:
            number: Number of the visitor.
            now: Time [s].
        """
        missed = tuple(one for one in self.missed if one.until > now)
        for place in self.places:
            if place.number == number and place.until is not None:
                missed = (*missed, Missed(place.source, now + MISSED_FOR))[-MAX_MISSED:]
        return replace(self.come(number), missed=missed)

    def hand_on(self, number: int, to: int) -> WaitQueue:
        """Return the queue with a place given to another connection of the same person.

        Args:
            number: Number of the connection that has the place.
            to: Number of the connection that gets the place.
        """
        places = tuple(replace(p, number=to) if p.number == number else p for p in self.places)
        return replace(self, places=places)

    def call(self, free: int, now: float) -> tuple[WaitQueue, tuple[int, ...]]:
        """Call as many visitors as there are seats, in the order of arrival.

        Args:
            free: Number of seats that are neither taken nor reserved for lost connections. This
                method subtracts the seats reserved for visitors who were called before.
            now: Time [s].

        Returns:
            The new queue, and the numbers of the visitors who were called now.
        """
        spare = free - self.called
        chosen: list[int] = []
        for place in self.places:
            if place.until is None and len(chosen) < spare:
                chosen.append(place.number)
        places = tuple(
            replace(p, until=now + TURN) if p.number in chosen else p for p in self.places
        )
        return replace(self, places=places), tuple(chosen)

    def turn_of(self, number: int) -> float | None:
        """Return the time at which a called visitor's turn ends [s]; None for other visitors."""
        return next((p.until for p in self.places if p.number == number), None)

    def late(self, now: float) -> tuple[int, ...]:
        """Return the numbers of the called visitors who have not come within their turn."""
        return tuple(p.number for p in self.places if p.until is not None and now >= p.until)

    def ranks(self) -> Mapping[int, tuple[int, int]]:
        """Map each visitor who is not called yet to its place (from 1) and the number of places."""
        waiting = [p.number for p in self.places if p.until is None]
        return {number: (k + 1, len(waiting)) for k, number in enumerate(waiting)}
