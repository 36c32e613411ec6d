"""Records which process owns each room, by a lease with a fencing token.

A room has one owner at a time, and each later owner has a higher epoch. The owner renews its lease.
An owner that does not renew its lease counts as alive until the lease has run out, unless there is
proof that the owner has ended. A message from an owner with an older epoch is outdated.

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
    """Right of one process to be the owner of a room until a given time.

    Args:
        room: Name of the room.
        holder: Unique name of the owner; every process has another one, also of the same room.
        epoch: Fencing token, higher than the token of every earlier owner; from 1.
        until: Time at which the lease ends unless it is renewed, on the clock of the caller [s].
        url: URL of the room for clients; empty for a process of this machine, to which connections
            are handed over.
    """

    room: str
    holder: str
    epoch: int
    until: float
    url: str = ""


class LeaseError(CohapticError):
    """Error: a room has another owner, or its lease has run out.

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
    """Interface of a directory of owners; all methods but `owner` may wait for a remote store.

    Times are on the clock of the caller [s].
    """

    @property
    def duration(self) -> float:
        """Time after which a lease ends unless it is renewed [s]."""
        ...

    def owner(self, room: str, now: float) -> Lease | None:
        """Return the owner's lease, as known here without waiting; None if there is no owner."""
        ...

    async def claim(self, room: str, holder: str, now: float, url: str = "") -> Lease:
        """Become the owner of a room that has no owner; raises LeaseError if it has one."""
        ...

    async def renew(self, lease: Lease, now: float) -> Lease:
        """Renew a lease; raises LeaseError if it has run out or the room has another owner."""
        ...

    async def release(self, lease: Lease) -> None:
        """End a lease when its holder ends, or when there is proof that the holder has ended."""
        ...


class LocalDirectory:
    """Directory in the memory of one process, for the rooms of that process.

    Args:
        duration: Time after which a lease ends unless it is renewed [s].
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
        """Return the lease of the owner; None if there is no owner or the lease has run out."""
        lease = self._leases.get(room)
        return lease if lease is not None and now < lease.until else None

    async def claim(self, room: str, holder: str, now: float, url: str = "") -> Lease:
        """Become the owner of a room that has no owner.

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
        """Renew a lease.

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
        """End a lease; do nothing if the room has another owner."""
        owner = self._leases.get(lease.room)
        if owner is not None and owner.epoch == lease.epoch:
            del self._leases[lease.room]
