"""Who was put out of a room, and for how long; the list is bounded."""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic_server.access.admission import Guest
from cohaptic_server.access.denied import forbidden

KICKED_FOR = 300.0  # s; long enough to calm down, and to be told why
MOST_REMOVED = 256  # of whom the oldest is forgotten first; only an administrator adds to it


@dataclass(frozen=True, slots=True)
class _Removal:
    guest: Guest
    name: str
    source: str
    until: float  # s; infinite for a ban
    at: float  # Unix time [s]


class Removed:
    """Who may not come back into one room."""

    def __init__(self) -> None:
        self._removals: list[_Removal] = []

    def __len__(self) -> int:
        return len(self._removals)

    def add(
        self, guest: Guest, name: str, source: str, now: float, wall: float, *, ban: bool
    ) -> None:
        """Keep somebody out.

        Args:
            guest: Who it is.
            name: That it touched by.
            source: Whom its connection is counted with; it counts for one without a token alone.
            now: Time [s].
            wall: Unix time [s].
            ban: Whether for as long as the server runs.
        """
        until = float("inf") if ban else now + KICKED_FOR
        self._removals = [one for one in self._removals if one.until > now][1 - MOST_REMOVED :]
        self._removals.append(_Removal(guest, name, source, until, wall))

    def check(self, guest: Guest, name: str, source: str, now: float) -> None:
        """Raise Denied for one who was put out and whose time is not over.

        Args:
            guest: Who it is.
            name: That it wants to touch by; empty for one who watches.
            source: Whom its connection is counted with.
            now: Time [s].
        """
        for one in self._removals:
            if now < one.until and _is_same(one, guest, name, source):
                if one.until == float("inf"):
                    raise forbidden("you were banned from this room")
                wait = f"you may come back in {one.until - now:.0f} s"
                raise forbidden("you were put out of this room", wait)


def _is_same(one: _Removal, guest: Guest, name: str, source: str) -> bool:
    if name and name == one.name:
        return True
    if not one.guest.session:
        return not guest.session and source == one.source
    if guest.session == one.guest.session:
        return True
    # A ban takes the invitation with it, but nobody who came with it before.
    banned = one.until == float("inf")
    return banned and guest.invitation == one.guest.invitation and guest.since >= one.at
