"""Who was put out of a room, and for how long; the list is bounded."""

from __future__ import annotations

from collections.abc import Callable

from pydantic import TypeAdapter, ValidationError

from cohaptic.protocol.control.message import Name
from cohaptic_server.access.admission import Guest
from cohaptic_server.access.denied import forbidden
from cohaptic_server.access.remembered import MOST_REMOVED, Pardon, Record, Removal
from cohaptic_server.room.seats.names import looks_like

_NAME: TypeAdapter[str] = TypeAdapter(Name)
KICKED_FOR = 300.0  # s; long enough to calm down, and to be told why


class Removed:
    """Who may not come back into one room.

    Args:
        keep: Called with each who is put out, for processes to come.
    """

    def __init__(self, keep: Callable[[Record], None] | None = None) -> None:
        self._keep = keep
        # Beside each the time until which it holds on this process's clock [s]: a wall clock that
        # is stepped shortens and lengthens nothing while the process runs.
        self._removals: list[tuple[Removal, float]] = []

    def __len__(self) -> int:
        return len(self._removals)

    def recall(self, removal: Removal, now: float, wall: float) -> None:
        """Keep somebody out whom an earlier process has put out.

        Args:
            removal: Who it is.
            now: Time [s].
            wall: Unix time [s].
        """
        if removal.until is None:
            self._add(removal, float("inf"), now)
        elif removal.counts(wall):
            # A wall clock that was set back meanwhile keeps nobody out for longer than a kick.
            self._add(removal, now + min(removal.until - wall, KICKED_FOR), now)

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
            ban: Whether for good.
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
        """Let those come back who were put out by a name; returns whether there were any.

        Args:
            name: That they touched by, or one that looks like it: it keeps out whoever has it.
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
        """By which those touched who may not come back yet, each once, the newest last.

        What is no name is left out: a journal may have it of another version, or of a person's own
        hand, and nothing could carry it.
        """
        names = (one.name for one, until in self._removals if until > now)
        return tuple(dict.fromkeys(name for name in names if _is_name(name)))

    def _add(self, removal: Removal, until: float, now: float) -> None:
        counting = [one for one in self._removals if one[1] > now]
        if len(counting) >= MOST_REMOVED:
            # The oldest who would come back anyway; a ban goes only where all are bans.
            kicks = [k for k, (_, until) in enumerate(counting) if until < float("inf")]
            del counting[kicks[0] if kicks else 0]
        self._removals = [*counting, (removal, until)]

    def check(self, guest: Guest, name: str, source: str, now: float) -> None:
        """Raise Denied for one who was put out and whose time is not over.

        Args:
            guest: Who it is.
            name: That it wants to touch by; empty for one who watches.
            source: Whom its connection is counted with.
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
    # A ban takes the invitation with it, but nobody who came with it before.
    banned = one.until is None
    return banned and guest.invitation == one.invitation and guest.since >= one.at
