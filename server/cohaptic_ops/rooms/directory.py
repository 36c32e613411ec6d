"""The owners of rooms: a lease with a fencing token for each room.

A room has one owner at a time, and each later owner has a higher epoch. The owner renews its lease.
An owner that does not renew its lease counts as alive until the lease has run out, unless there is
proof of its end. A message from an owner with a lower epoch than the newest is outdated.

The directory of one machine is in memory. A directory of several machines, in a store with
compare-and-set, would have the same interface: the epoch is the revision of the owner's record.
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
        room: Name of the room.
        holder: Unique name of the owner, which no other process has, not even a later one of the
            same room.
        epoch: Fencing token, higher than that of every earlier owner; from 1.
        until: Time at which the lease ends unless it is renewed, on the clock of the caller [s].
        url: URL of the room for clients; empty for a process of this machine, which gets its
            connections handed over.
    """

    room: str
    holder: str
    epoch: int
    until: float
    url: str = ""


class LeaseError(CohapticError):
    """A room has another owner, or the lease of a room has run out.

    Args:
        room: Name of the room.
        problem: Reason in words.
    """

    def __init__(self, room: str, problem: str) -> None:
        super().__init__(room, problem)
        self.room, self.problem = room, problem

    def __str__(self) -> str:
        return f"room {self.room}: {self.problem}"


class Directory(Protocol):
    """Owners of rooms; all methods but `owner` may wait for a store; times are the caller's [s]."""

    @property
    def duration(self) -> float:
        """Term of a lease unless it is renewed [s]."""
        ...

    def owner(self, room: str, now: float) -> Lease | None:
        """The owner as known here, without waiting; None if there is none."""
        ...

    async def claim(self, room: str, holder: str, now: float, url: str = "") -> Lease:
        """Become the owner of a room that has none; raises LeaseError."""
        ...

    async def renew(self, lease: Lease, now: float) -> Lease:
        """Stay the owner; raises LeaseError if there is another one or the lease has run out."""
        ...

    async def release(self, lease: Lease) -> None:
        """Give up the room, at the end of the holder or with proof of it."""
        ...


class LocalDirectory:
    """The directory of the rooms of one process, in its memory.

    Args:
        duration: Term of a lease [s].
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
        """The lease of the owner; None if there is no owner or its lease has run out."""
        lease = self._leases.get(room)
        return lease if lease is not None and now < lease.until else None

    async def claim(self, room: str, holder: str, now: float, url: str = "") -> Lease:
        """Become the owner of a room that has none.

        Raises:
            LeaseError: The room has an owner.
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
            LeaseError: The lease has run out, or the room has another owner.
        """
        owner = self.owner(lease.room, now)
        if owner is None or owner.epoch != lease.epoch:
            raise LeaseError(lease.room, f"no more owned by {lease.holder}")
        until = max(owner.until, now + self.duration)
        renewed = Lease(lease.room, lease.holder, lease.epoch, until, lease.url)
        self._leases[lease.room] = renewed
        return renewed

    async def release(self, lease: Lease) -> None:
        """Give up the room; do nothing if it has another owner."""
        owner = self._leases.get(lease.room)
        if owner is not None and owner.epoch == lease.epoch:
            del self._leases[lease.room]
