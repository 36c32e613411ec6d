"""How many people a room may have at once: its own limit, and its share of the server's seats."""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic.errors import CloseCode, RemoteProtocolError


@dataclass(slots=True)
class Seating:
    """Of users, or of watchers.

    Args:
        most: Of the room.
        who: Such as "users".
        instead: What who finds no seat can do.

    Attributes:
        held: Seats of the server that the room holds; None where it has them to itself.
        wanted: That it is to hold; those in use are given back when somebody leaves.
    """

    most: int
    who: str
    instead: str = ""
    held: int | None = None
    wanted: int = 0

    def allow(self, wanted: int, used: int) -> None:
        """Hold so many from now on, or as many more as are in use."""
        self.wanted = wanted
        self.held = max(wanted, used)

    def give_back(self, used: int) -> int:
        """Hold no more than is wanted or in use; returns how many that are."""
        if self.held is None:
            return self.most
        self.held = min(self.held, max(self.wanted, used))
        return self.held

    @property
    def limit(self) -> int:
        """How many may sit now."""
        return self.most if self.held is None else min(self.most, self.held)

    def check(self, present: int, kept: int = 0, promised: int = 0) -> None:
        """Raise RemoteProtocolError if there is no seat for one more.

        Args:
            present: How many are here.
            kept: How many more seats wait for those whose connections were just lost.
            promised: How many more are for those who came before and wait.
        """
        limit = self.limit
        if present + kept + promised < limit:
            return
        words = (
            f"at most {limit}"
            if limit == self.most
            else (f"at most {limit}: the other rooms of this server have its other seats")
        )
        if kept:
            words += f"; {kept} of them kept a few seconds for who lost the connection: try again"
        if promised:
            words += f"; {promised} wait for a place already"
        count = present + kept + promised + 1
        name = f"number of {self.who}"
        raise RemoteProtocolError(name, count, words + self.instead, CloseCode.ROOM_FULL)
