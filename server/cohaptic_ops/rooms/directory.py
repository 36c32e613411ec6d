"""Who owns each room: a lease with a fencing token.

A room has one owner at a time, and each later owner has a higher epoch. The owner renews its lease;
one that does not must be taken for alive until the lease has run out, unless there is proof of its
end. Whatever is received from an owner with a lower epoch than the newest is from the past.

The directory of one machine is in memory. One of several machines, in a store with compare-and-set,
has the same interface: its revision of the owner's record is the epoch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from cohaptic.errors import CohapticError


@dataclass(frozen=True, slots=True)
class Lease:
    """Lease of a room.

    Args:
        room: Its name.
        holder: Its owner: a name that no other process has, nor a later one of the same room.
        epoch: Fencing token, higher than that of every earlier owner; from 1.
        until: When it ends unless it is renewed, on the clock of the caller [s].
        url: Where clients find it; empty for a process of this machine that gets its sockets.
    """

    room: str
    holder: str
    epoch: int
    until: float
    url: str = ""


class LeaseError(CohapticError):
    """A room cannot be had, or is owned no more.

    Args:
        room: Its name.
        problem: Why.
    """

    def __init__(self, room: str, problem: str) -> None:
        super().__init__(room, problem)
        self.room, self.problem = room, problem

    def __str__(self) -> str:
        return f"room {self.room}: {self.problem}"


class Directory(Protocol):
    """Owners of rooms. All but `owner` may wait for a store; times are the caller's [s]."""

    @property
    def duration(self) -> float:
        """How long a lease lasts unless it is renewed [s]."""
        ...

    def owner(self, room: str, now: float) -> Lease | None:
        """The owner as it is known here, at once; None while there is none."""
        ...

    async def claim(self, room: str, holder: str, now: float, url: str = "") -> Lease:
        """Become the owner of a room that has none; raises LeaseError."""
        ...

    async def renew(self, lease: Lease, now: float) -> Lease:
        """Stay the owner; raises LeaseError if another one is, or the lease has run out."""
        ...

    async def release(self, lease: Lease) -> None:
        """Be the owner no more, at the end of the holder or with proof of it."""
        ...


class LocalDirectory:
    """The directory of the rooms of one process, in its memory.

    Args:
        duration: Duration of a lease [s].
    """

    def __init__(self, duration: float) -> None:
        self.duration = duration
        self._leases: dict[str, Lease] = {}
        self._epochs: dict[str, int] = {}

    @property
    def epochs(self) -> Mapping[str, int]:
        """Newest epoch of each room that ever had an owner."""
        return self._epochs

    def owner(self, room: str, now: float) -> Lease | None:
        """The owner; None if nobody is, or its lease has run out."""
        lease = self._leases.get(room)
        return lease if lease is not None and now < lease.until else None

    async def claim(self, room: str, holder: str, now: float, url: str = "") -> Lease:
        """Become the owner of a room that has none.

        Raises:
            LeaseError: It has one.
        """
        owner = self.owner(room, now)
        if owner is not None:
            raise LeaseError(room, f"owned by {owner.holder} for {owner.until - now:.1f} s")
        epoch = self._epochs[room] = self._epochs.get(room, 0) + 1
        lease = self._leases[room] = Lease(room, holder, epoch, now + self.duration, url)
        return lease

    async def renew(self, lease: Lease, now: float) -> Lease:
        """Stay the owner.

        Raises:
            LeaseError: The lease has run out, or another one is the owner.
        """
        owner = self.owner(lease.room, now)
        if owner is None or owner.epoch != lease.epoch:
            raise LeaseError(lease.room, f"no more owned by {lease.holder}")
        until = max(owner.until, now + self.duration)
        renewed = Lease(lease.room, lease.holder, lease.epoch, until, lease.url)
        self._leases[lease.room] = renewed
        return renewed

    async def release(self, lease: Lease) -> None:
        """Be the owner no more; nothing if another one is."""
        owner = self._leases.get(lease.room)
        if owner is not None and owner.epoch == lease.epoch:
            del self._leases[lease.room]
