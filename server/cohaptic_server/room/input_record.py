"""Tells a recorder all that a room takes in, in the order of its work.

It is enough to compute every patch of the room again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import Restraints, SetLaw
from cohaptic.sessions.entries import (
    Asked,
    BodyReset,
    BudgetSet,
    Heard,
    Joined,
    LawSet,
    Left,
    PassedOver,
    Restrained,
    Solved,
    Ticked,
    Written,
)
from cohaptic_server.room.member import Member

Record = Callable[[Written], None]  # Takes an entry of a session, and returns at once.
# Takes down that columns were asked for, or have come, at present.
ColumnRecord = Callable[[type[Asked] | type[Solved]], None]


class InputRecord:
    """The inputs of one room as entries of a session.

    Args:
        write: Takes an entry, and returns at once.
        present: Users who are in the room already.
        now: Time [s].

    Attributes:
        write: As given; another one may take its place.
    """

    def __init__(self, write: Record, present: Iterable[Member], now: float) -> None:
        self.write = write
        self._restraints = Restraints()
        self._budget: float | None = None
        for member in present:
            self.joined(member, now)

    def joined(self, member: Member, now: float) -> None:
        """A user has joined."""
        hello, cap = member.hello, member.who.max_force
        told = hello.model_dump(mode="json")
        # Without the address, which says more of a person than a study needs.
        self.write(Joined(now, member.user, hello.name, told, cap))

    def left(self, user: int, reason: str, now: float) -> None:
        """A user has left."""
        self.write(Left(now, user, reason))

    def law(self, user: int, change: SetLaw, now: float) -> None:
        """A user has changed its law."""
        self.write(LawSet(now, user, change.model_dump(mode="json")))

    def heard(self, user: int, sample: ContactSample, now: float) -> None:
        """A sample of a user has come."""
        self.write(Heard(now, user, sample.encode()))

    def ticked(self, tick: int, restraints: Restraints, budget: float | None, now: float) -> None:
        """The room advances to a tick under an administrator's orders."""
        if restraints != self._restraints:
            self._restraints = restraints
            self.write(Restrained(now, restraints.frozen, restraints.muted))
        if budget != self._budget:
            self._budget = budget
            self.write(BudgetSet(now, budget))
        self.write(Ticked(now, tick))

    def passed_over(self, ticks: int, now: float) -> None:
        """The room at rest counts some ticks."""
        self.write(PassedOver(now, ticks))

    def reset(self, now: float) -> None:
        """The body is to return to its initial state."""
        self.write(BodyReset(now))
