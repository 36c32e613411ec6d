"""Who is muted, also once it has left: to come back unmutes nobody. The list is bounded."""

from __future__ import annotations

from cohaptic_server.room.seats.lookalikes import looks_like
from cohaptic_server.room.seats.names import Claim

MOST_MUTED = 256  # of whom the oldest is forgotten first; only an administrator adds to it


class Muted:
    """Of one room."""

    def __init__(self) -> None:
        self._who: list[tuple[str, Claim]] = []

    def __len__(self) -> int:
        return len(self._who)

    def add(self, name: str, claim: Claim) -> None:
        """Mute somebody."""
        self.take_out(name, claim)
        self._who = [*self._who, (name, claim)][-MOST_MUTED:]

    def take_out(self, name: str, claim: Claim) -> None:
        """Mute somebody no more."""
        self._who = [one for one in self._who if not _is_same(one, name, claim)]

    def holds(self, name: str, claim: Claim) -> bool:
        """Whether somebody is muted, by its name, its secret or its session."""
        return any(_is_same(one, name, claim) for one in self._who)


def _is_same(one: tuple[str, Claim], name: str, claim: Claim) -> bool:
    # Without a secret a claim is its address, which others may share.
    return looks_like(one[0], name) or (claim.is_secret and claim.is_of(one[1]))
