"""Bounded list of the users who were put out of a room, each with the end of the removal."""

from __future__ import annotations

from collections.abc import Callable

from pydantic import TypeAdapter, ValidationError

from cohaptic.protocol.control.message import Name
from cohaptic_server.access.admission import Guest
from cohaptic_server.access.denied import forbidden
from cohaptic_server.access.remembered import MOST_REMOVED, Pardon, Record, Removal
from cohaptic_server.room.seats.names import looks_like

_NAME: TypeAdapter[str] = TypeAdapter(Name)
KICKED_FOR = 300.0  # s; enough for the user to calm down and to be told the reason


class Removed:
    """The users who may not come back into one room.

    Args:
        keep: Function that stores each removal and pardon for later processes; None for no storage.
    """

    def __init__(self, keep: Callable[[Record], None] | None = None) -> None:
        self._keep = keep
        # Each removal with its end on the clock of this process [s], so that a step of the wall
        # clock changes no removal while the process runs.
        self._removals: list[tuple[Removal, float]] = []

    def __len__(self) -> int:
        return len(self._removals)

    def recall(self, removal: Removal, now: float, wall: float) -> None:
        """Keep out a user whom an earlier process has put out.

        Args:
            removal: Record of the earlier process.
            now: Time [s].
            wall: Unix time [s].
        """
        if removal.until is None:
            self._add(removal, float("inf"), now)
        elif removal.counts(wall):
            # A kick ends within KICKED_FOR even if the wall clock was set back meanwhile.
            self._add(removal, now + min(removal.until - wall, KICKED_FOR), now)

    def add(
        self, guest: Guest, name: str, source: str, now: float, wall: float, *, ban: bool
    ) -> None:
        """Keep a user out from now on.

        Args:
            guest: Identity of the user.
            name: Name that the user touched under.
            source: Network address whose budgets the user's connection spends; compared only for
                users without a token.
            now: Time [s].
            wall: Unix time [s].
            ban: Whether the user is kept out for good.
        """
        removal = Removal(
            session=guest.session,
            invitation=guest.invitation,
            name=name,
            source=source,
            at=wall,
            until=None if ban else wall + KICKED_FOR,
        )
        self._add(removal, float("inf") if ban else now + KICKED_FOR, now)
        if self._keep is not None:
            self._keep(removal)

    def pardon(self, name: str, now: float, wall: float) -> bool:
        """Pardon all users who were put out under a name; return whether there were any.

        Args:
            name: Name that the users touched under, or one that looks like it; such names keep
                users out as well.
            now: Time [s].
            wall: Unix time [s].
        """
        pardoned = [one for one in self._removals if looks_like(one[0].name, name)]
        if not any(until > now for _, until in pardoned):
            return False
        self._removals = [one for one in self._removals if one not in pardoned]
        if self._keep is not None:
            for written in dict.fromkeys(one.name for one, _ in pardoned):
                self._keep(Pardon(name=written, at=wall))
        return True

    def names(self, now: float) -> tuple[str, ...]:
        """Names of the users who may not come back yet, each name once, the newest last.

        Invalid names are left out, since no message could carry them. A journal of another version,
        or one edited by hand, may contain them.
        """
        names = (one.name for one, until in self._removals if until > now)
        return tuple(dict.fromkeys(name for name in names if _is_name(name)))

    def _add(self, removal: Removal, until: float, now: float) -> None:
        counting = [one for one in self._removals if one[1] > now]
        if len(counting) >= MOST_REMOVED:
            # Drop the oldest kick, which would end anyway; drop a ban only if all are bans.
            kicks = [k for k, (_, until) in enumerate(counting) if until < float("inf")]
            del counting[kicks[0] if kicks else 0]
        self._removals = [*counting, (removal, until)]

    def check(self, guest: Guest, name: str, source: str, now: float) -> None:
        """Raise Denied for a user who was put out and whose time is not over.

        Args:
            guest: Identity of the user.
            name: Name that the user wants to touch under; empty if the user watches.
            source: Network address whose budgets the user's connection spends.
            now: Time [s].
        """
        for one, until in self._removals:
            if now < until and _is_same(one, guest, name, source):
                if one.until is None:
                    raise forbidden("you were banned from this room")
                wait = f"you may come back in {until - now:.0f} s"
                raise forbidden("you were put out of this room", wait)


def _is_name(text: str) -> bool:
    try:
        _NAME.validate_python(text)
    except ValidationError:
        return False
    return True


def _is_same(one: Removal, guest: Guest, name: str, source: str) -> bool:
    if name and looks_like(name, one.name):
        return True
    if not one.session:
        return not guest.session and source == one.source
    if guest.session == one.session:
        return True
    # A ban also covers the user's invitation, except sessions that began with it before the ban.
    banned = one.until is None
    return banned and guest.invitation == one.invitation and guest.since >= one.at
