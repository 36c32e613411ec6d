"""Who waits for a seat in a full room, in the order of coming; a value, whose changes make another.

    enter --> waits --call--> called --come--> in the room
                |               |
                +--- leave      +--- nothing within TURN, or leave: a missed turn ---> out

A seat that is free calls the first who waits, and is kept for it while it is called. Nobody jumps
the queue: as long as somebody waits, no free seat is anybody else's. A missed turn costs the others
a seat for a while, so its address has a place less for longer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from cohaptic.errors import CloseCode, RemoteProtocolError

# s for who is called to come. A client answers by itself, at once; who does not costs the others
# that much of a seat, and a path that stalls for longer is as good as lost.
TURN = 5.0
# s for which the place of a missed turn stays used for its address. Without it a few addresses that
# never take a seat, and come back at once, would hold the queue for ever.
MISSED_FOR = 60.0
MOST_MISSED = 1024  # that are remembered; more than the turns of the largest room in that time


@dataclass(frozen=True, slots=True)
class Place:
    """Place of one visitor who waits.

    Args:
        number: By which the caller knows who it is.
        source: Whom its connection is counted with.
        until: When its turn is over [s]; None before it is called.
    """

    number: int
    source: str
    until: float | None = None


@dataclass(frozen=True, slots=True)
class Missed:
    """A turn that somebody was called to and did not take.

    Args:
        source: Address of who it was.
        until: For which it has a place less until then [s].
    """

    source: str
    until: float


@dataclass(frozen=True, slots=True)
class WaitQueue:
    """All who wait for one room.

    Args:
        most: Places; 0 for no queue.
        most_of_source: Most of them for one address: a queue of one address would be nobody else's.
        places: In the order of coming.
        missed: Turns of late, the oldest first.
    """

    most: int
    most_of_source: int
    places: tuple[Place, ...] = ()
    missed: tuple[Missed, ...] = ()

    def __len__(self) -> int:
        return len(self.places)

    def __contains__(self, number: int) -> bool:
        return any(place.number == number for place in self.places)

    @property
    def called(self) -> int:
        """How many were called and have not come yet; a seat is kept for each."""
        return sum(place.until is not None for place in self.places)

    def enter(self, number: int, source: str, now: float) -> WaitQueue:
        """With one more, at the end.

        Args:
            number: Number of who enters.
            source: Whom its connection is counted with.
            now: Time [s].

        Raises:
            RemoteProtocolError: The queue is full, or this address has all places that it may.
        """
        if number in self:
            raise ValueError(f"{number} waits already")
        of_source = sum(place.source == source for place in self.places)
        ends = [missed.until for missed in self.missed if missed.source == source]
        ends = [end for end in ends if end > now]
        share = max(0, self.most_of_source - len(ends))
        why = ", since turns were missed there" if ends else ""
        why += f"; a place more in {ends[0] - now:.0f} s" if ends else ""
        for subject, waiting, limit, words in (
            ("number of people who wait", len(self.places), self.most, ""),
            ("number of people who wait from one address", of_source, share, why),
        ):
            if waiting >= limit:
                raise RemoteProtocolError(
                    subject, waiting + 1, f"at most {limit}{words}", CloseCode.ROOM_FULL
                )
        return replace(self, places=(*self.places, Place(number, source)))

    def come(self, number: int) -> WaitQueue:
        """Without one who takes its seat; the same if it does not wait."""
        return replace(self, places=tuple(p for p in self.places if p.number != number))

    def leave(self, number: int, now: float) -> WaitQueue:
        """Without one who has gone; the same if it does not wait.

        Args:
            number: Number of who has gone.
            now: Time [s]. Who was called has missed its turn.
        """
        missed = tuple(one for one in self.missed if one.until > now)
        for place in self.places:
            if place.number == number and place.until is not None:
                missed = (*missed, Missed(place.source, now + MISSED_FOR))[-MOST_MISSED:]
        return replace(self.come(number), missed=missed)

    def hand_on(self, number: int, to: int) -> WaitQueue:
        """With the place of one connection given to another of the same person."""
        places = tuple(replace(p, number=to) if p.number == number else p for p in self.places)
        return replace(self, places=places)

    def call(self, free: int, now: float) -> tuple[WaitQueue, tuple[int, ...]]:
        """Call as many as there are seats, the first first.

        Args:
            free: Seats that nobody sits in and that are kept for nobody who lost a connection.
                Those that are kept for visitors who were called before are taken off here.
            now: Time [s].

        Returns:
            The queue, and who was called now.
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
        """When the turn of one who was called is over [s]; None for everybody else."""
        return next((p.until for p in self.places if p.number == number), None)

    def late(self, now: float) -> tuple[int, ...]:
        """Whose turn is over."""
        return tuple(p.number for p in self.places if p.until is not None and now >= p.until)

    def told(self) -> Mapping[int, tuple[int, int]]:
        """Place (from 1), and number of places, for each who waits to be called."""
        waiting = [p.number for p in self.places if p.until is None]
        return {number: (k + 1, len(waiting)) for k, number in enumerate(waiting)}
