"""Leases of rooms: a room has one owner at a time, as long as no clock is wrong by 5 %. No I/O.

Some nodes of a cluster are its witnesses. A node owns a room for `term` seconds from the time at
which it asked for it, if more than half of the witnesses have granted it; asking again renews this.
A witness that has granted a room gives it to nobody else for that time. Two majorities have a
witness in common, so that two nodes never own a room at once, whichever nodes are cut off, paused
or dead, and whatever the engine believes that places the rooms. This is PaxosLease (Trencseni,
Gazso and Reinhardt, 2012) with a number for each owner (`epoch`), which outlives its lease.

A witness forgets all when it is started again, and therefore grants nothing for its first term.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

# A witness keeps a promise for longer than the owner counts on it, by more than two clocks differ.
_LONGER: Final = 1.05
# Share of a term after which a claim fails that some witness refuses; some times as long as a
# question and its answer.
_CONTESTED: Final = 0.1
NEVER: Final = float("-inf")


@dataclass(frozen=True, slots=True)
class Grant:
    """Promise of a witness.

    Args:
        owner: Unique name of the owner's process.
        address: Address of the owner's node.
        epoch: Number of the owner, higher than that of every earlier owner of the room.
        until: Time until which the witness gives the room to nobody else [s].
    """

    owner: str
    address: str
    epoch: int
    until: float


class Witness:
    """Grants rooms, and says who owns them.

    Args:
        rooms: Names of all rooms that may be owned.
        term: Duration of a lease [s].
        now: Time [s].
    """

    def __init__(self, rooms: Collection[str], term: float, now: float) -> None:
        self._rooms, self._lasts = frozenset(rooms), term * _LONGER
        self._silent_until = now + self._lasts
        self._grants: dict[str, Grant] = {}

    def grant(
        self, owner: str, address: str, asked: Mapping[str, int], now: float
    ) -> tuple[dict[str, int], dict[str, int]]:
        """Grant rooms to a process, or renew its grants.

        Args:
            owner: Unique name of the process.
            address: Address of its node.
            asked: Number (epoch) under which it wants to own each room.
            now: Time [s].

        Returns:
            Granted rooms with their numbers, and refused rooms with the newest number of an owner.
        """
        granted, refused = dict[str, int](), dict[str, int]()
        if self.silent(now):
            return granted, refused
        for room, epoch in asked.items():
            old = self._grants.get(room)
            own = old is not None and old.owner == owner and epoch >= old.epoch
            newer = old is None or (epoch > old.epoch and now >= old.until)
            if room in self._rooms and (own or newer):
                self._grants[room] = Grant(owner, address, epoch, now + self._lasts)
                granted[room] = epoch
            else:
                refused[room] = old.epoch if old is not None else 0
        return granted, refused

    def free(self, owner: str, rooms: Mapping[str, int]) -> None:
        """End grants at the word of their owner, whose rooms have ended.

        Args:
            owner: Unique name of the owner's process.
            rooms: Rooms, with their last numbers; a later grant to the same process stays.
        """
        for room, epoch in rooms.items():
            old = self._grants.get(room)
            if old is not None and old.owner == owner and old.epoch <= epoch:
                self._grants[room] = Grant(owner, old.address, old.epoch, NEVER)

    def silent(self, now: float) -> bool:
        """Whether it may have forgotten grants that still hold, so that it grants nothing."""
        return now < self._silent_until

    def owned(self, now: float) -> dict[str, str]:
        """Return the address of the owner's node of each room that has an owner."""
        return {room: grant.address for room, grant in self._grants.items() if now < grant.until}

    def owner(self, room: str, now: float) -> Grant | None:
        """Return the grant of the process that may own a room; None if there is none."""
        grant = self._grants.get(room)
        return grant if grant is not None and now < grant.until else None


@dataclass(slots=True)
class _Claim:
    epoch: int
    since: float
    granted: dict[str, float] = field(default_factory=dict[str, float])
    against: set[str] = field(default_factory=set[str])  # witnesses that keep it for another
    held: bool = False


class Claims:
    """Rooms that one process owns or wants to own.

    Args:
        witnesses: Number of witnesses.
        term: Duration of a lease [s].
    """

    def __init__(self, witnesses: int, term: float) -> None:
        self._enough, self._term = witnesses // 2 + 1, term
        self._claims: dict[str, _Claim] = {}
        self._last: dict[str, int] = {}

    def want(self, room: str, now: float) -> None:
        """Begin to ask for a room; without effect if the process does so already."""
        self._claims.setdefault(room, _Claim(self.last(room) + 1, now))

    def drop(self, room: str) -> None:
        """Ask for a room no more."""
        claim = self._claims.pop(room, None)
        if claim is not None:
            self._last[room] = claim.epoch

    def last(self, room: str) -> int:
        """Return the number of the last claim that has ended; 0 before any. None is used twice."""
        return self._last.get(room, 0)

    @property
    def asked(self) -> dict[str, int]:
        """Rooms to ask for, with the numbers (epochs) under which they are to be owned."""
        return {room: claim.epoch for room, claim in self._claims.items()}

    def heard(
        self,
        witness: str,
        sent: float,
        granted: Mapping[str, int],
        refused: Mapping[str, int],
    ) -> None:
        """Take an answer of a witness.

        Args:
            witness: Name of the witness.
            sent: Time at which the answered question was sent [s].
            granted, refused: Answer, as of `Witness.grant`.
        """
        for room, epoch in granted.items():
            claim = self._claims.get(room)
            if claim is not None and claim.epoch == epoch:
                claim.granted[witness] = max(sent, claim.granted.get(witness, sent))
                claim.against.discard(witness)
        for room, newest in refused.items():
            claim = self._claims.get(room)
            if claim is None:
                continue
            claim.granted.pop(witness, None)
            if claim.held:
                # Another has asked this witness meanwhile, which takes no lower number any more.
                claim.epoch = max(claim.epoch, newest + 1)
            elif newest >= claim.epoch:
                self._claims[room] = _Claim(newest + 1, claim.since)
            else:
                claim.against.add(witness)

    def until(self, room: str) -> float:
        """Return the time until which this process owns a room [s]; `NEVER` without a majority."""
        claim = self._claims.get(room)
        times = sorted(claim.granted.values(), reverse=True) if claim is not None else []
        return times[self._enough - 1] + self._term if len(times) >= self._enough else NEVER

    def epoch(self, room: str, now: float) -> int | None:
        """Return the number under which this process owns a room now; None if it does not."""
        claim = self._claims.get(room)
        return claim.epoch if claim is not None and claim.held and now < self.until(room) else None

    def settle(self, now: float) -> tuple[Sequence[str], Sequence[str], Sequence[str]]:
        """Return rooms that the process owns from now on, owns no more, and has failed to get.

        Rooms of the last kind should be freed, and wanted again only after a random while, so that
        processes that want a room at once do not keep it from each other.
        """
        gained, lost, failed = list[str](), list[str](), list[str]()
        for room, claim in list(self._claims.items()):
            owned = now < self.until(room)
            if owned and not claim.held:
                claim.held = True
                gained.append(room)
            elif claim.held and not owned:
                lost.append(room)
                self.drop(room)
            elif not owned and now - claim.since > self._term * (
                _CONTESTED if claim.against else 1.0
            ):
                failed.append(room)
                self.drop(room)
        return gained, lost, failed
