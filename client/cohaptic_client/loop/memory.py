"""Slots for newest values, and a ring of rows, in memory that the client's two processes share.

The network process and the haptic loop share one memory-mapped file. A slot holds one value. A
write replaces it, and a read never waits: there is no lock, so neither side can delay the other. A
read during a write sees a wrong checksum; the reader keeps its old value until the next period.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import struct
import tempfile
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from cohaptic.protocol.frame import MAX_MESH_FRAME_BYTES
from cohaptic.runtime.owned_files import own, remove_leftovers
from cohaptic.status.row import ROW
from cohaptic_client.devices.scripted import TARGET

# heartbeat, stop, whether the row of every period is wanted, faults acknowledged so far
COMMAND: Final = struct.Struct("<Q??I")
# time, tick of the patch in use, probe, force on body, whether there is an anchor, and the anchor,
# whether there is a deflection, and the deflection
SAMPLE: Final = struct.Struct("<dI6d?3d?d")
_HEAD: Final = struct.Struct("<QII")  # version, length, checksum of version and payload
_VERSION: Final = struct.Struct("<Q")
_COUNT: Final = struct.Struct("<Q")
RING_ROWS: Final = 8192  # 2 s at 4 kHz; the network process empties it every 0.1 to 0.6 s


class Slot:
    """One value of at most `capacity` bytes at a fixed offset in the shared memory.

    Attributes:
        version: Number of the last value that was written or read; 0 before.
    """

    def __init__(self, memory: mmap.mmap, offset: int, capacity: int) -> None:
        self._memory = memory
        self._offset = offset
        self._capacity = capacity
        self.version = 0

    @staticmethod
    def size(capacity: int) -> int:
        """Return the number of bytes that a slot for a value of `capacity` bytes takes."""
        return _HEAD.size + capacity

    def write(self, payload: bytes, version: int = 0) -> None:
        """Replace the value, which gets the next version or, if not 0, another later one."""
        assert len(payload) <= self._capacity
        self.version = version or self.version + 1
        check = zlib.crc32(payload, self.version & 0xFFFFFFFF)
        frame = _HEAD.pack(self.version, len(payload), check) + payload
        self._memory[self._offset : self._offset + len(frame)] = frame

    def read(self) -> bytes | None:
        """Return the value if it is new since the last call, else None."""
        start = self._offset
        # The loop reads in every period, and mostly finds nothing new.
        if _VERSION.unpack_from(self._memory, start)[0] == self.version:
            return None
        version, length, check = _HEAD.unpack_from(self._memory, start)
        if version == self.version or length > self._capacity:
            return None
        payload = self._memory[start + _HEAD.size : start + _HEAD.size + length]
        if zlib.crc32(payload, version & 0xFFFFFFFF) != check:
            return None
        self.version = version
        return payload


class Slots:
    """A few slots in turn, for values that come in bursts and are all wanted.

    A reader that falls behind by more than all slots goes on with a newer value.
    """

    def __init__(self, slots: list[Slot]) -> None:
        self._slots = slots
        self._count = 0  # of the last value; it is the version of its slot

    def write(self, payload: bytes) -> None:
        """Put a value after the last one; it replaces the oldest."""
        self._slots[self._count % len(self._slots)].write(payload, self._count + 1)
        self._count += 1

    def read(self) -> bytes | None:
        """Return the next value, or None while there is none."""
        slot = self._slots[self._count % len(self._slots)]
        payload = slot.read()
        if payload is not None:
            self._count = slot.version
        return payload


class RowRing:
    """Ring buffer with the last `RING_ROWS` rows of the loop; a slow reader loses the oldest.

    Attributes:
        lost: Number of rows that the reader has lost.
    """

    def __init__(self, memory: mmap.mmap, offset: int) -> None:
        self._memory = memory
        self._offset = offset
        self._count = 0
        self.lost = 0

    @staticmethod
    def size() -> int:
        """Return the number of bytes that the ring takes."""
        return _COUNT.size + RING_ROWS * ROW.size

    def prepare(self) -> None:
        """Write to every page once: the first write to a page costs several microseconds."""
        at = self._at(0)
        self._memory[at : at + RING_ROWS * ROW.size] = bytes(RING_ROWS * ROW.size)

    def append(self, row: tuple[float, ...]) -> None:
        """Write one row: a tuple of the values of a `Row`, in the order of its fields."""
        ROW.pack_into(self._memory, self._at(self._count), *row)
        self._count += 1
        _COUNT.pack_into(self._memory, self._offset, self._count)

    def read_new(self) -> bytes:
        """Return the rows since the last call, oldest first, for `cohaptic.status.row.rows_in`.

        Rows that this caller was too late for are counted in `lost`.
        """
        (count,) = _COUNT.unpack_from(self._memory, self._offset)
        # The writer may be overwriting the oldest rows of a full ring: leave a margin.
        first = max(self._count, count - RING_ROWS + 64)
        self.lost += first - self._count
        self._count = count
        turn = min(count, first + RING_ROWS - first % RING_ROWS)  # where the ring begins again
        return self._block(first, turn) + self._block(turn, count)

    def newest(self) -> bytes:
        """Return the newest row, without taking it from `read_new`; empty before the first."""
        (count,) = _COUNT.unpack_from(self._memory, self._offset)
        return self._block(count - 1, count) if count else b""

    def _block(self, first: int, end: int) -> bytes:
        """Return rows `first` to `end`, excluding `end`, as bytes; they must be contiguous."""
        at = self._at(first)
        return self._memory[at : at + (end - first) * ROW.size]

    def _at(self, i: int) -> int:
        """Return the offset at which row `i` begins [bytes]."""
        return self._offset + _COUNT.size + (i % RING_ROWS) * ROW.size


class LoopMemory:
    """The memory that the network process and the haptic loop share.

    Attributes:
        patch: Newest patch frames, for the loop.
        sample: Newest tip and force, for the network process.
        command: Heartbeat, stop flag and acknowledgements, for the loop.
        status: State, statistics and error of the loop as JSON, for the network process.
        target: Where a script wants its tip, for the loop.
        rows: Rows of the loop: one per period, or 20 per second if the recording of every period is
            off.
    """

    def __init__(self, path: str) -> None:
        self.path = path
        with open(path, "r+b") as file:
            own(file.fileno())  # the mapping keeps the lock after the file is closed
            self._memory = mmap.mmap(file.fileno(), _TOTAL)
        offsets = _offsets(_SLOTS)
        slots = [
            Slot(self._memory, offset, capacity)
            for offset, capacity in zip(offsets, _SLOTS, strict=False)
        ]
        self.patch = Slots(slots[:_PATCHES])
        self.sample, self.command, self.status, self.target = slots[_PATCHES:]
        self.rows = RowRing(self._memory, offsets[-1])

    @classmethod
    def create(cls) -> LoopMemory:
        """Make the file and map it; return the mapped memory.

        Raises:
            OSError: There is no room for the file.
        """
        # In memory where the system has such a folder, because a disk can make a writer wait.
        if os.access(_IN_MEMORY, os.W_OK):
            try:
                return cls(_reserved(_IN_MEMORY))
            except OSError:  # full, as in a small container
                pass
        return cls(_reserved(None))

    def close(self, *, remove: bool) -> None:
        """Unmap the file; if `remove` is true, delete it, too."""
        self._memory.close()
        if remove:
            # The file may be gone already; Windows keeps it while the other process has it mapped.
            with contextlib.suppress(FileNotFoundError, PermissionError):
                os.unlink(self.path)


def remove_killed(now: float) -> None:
    """Remove the files that killed clients have left behind; `now` is the Unix time [s]."""
    remove_leftovers(Path(_IN_MEMORY), _PREFIX, _SUFFIX, now, beside=MESH_SUFFIX)


_IN_MEMORY = "/dev/shm"  # Linux
_PREFIX, _SUFFIX = "cohaptic-loop-", ".shm"
MESH_SUFFIX: Final = ".mesh"  # appended to the path of the memory, for the resting mesh's file
# Patches that a link with jitter lets come at once; the loop takes one over in three periods.
_PATCHES = 8
# Bytes of the patches, sample, command, status and target. A status holds a sentence of 300
# characters, and JSON may write each of them as 12 bytes.
_SLOTS = (*[MAX_MESH_FRAME_BYTES] * _PATCHES, 128, 16, 4096, TARGET.size)


def _reserved(folder: str | None) -> str:
    """Make a file with all its bytes allocated, and return its path.

    Without the allocation, a write to a missing byte would end the process.

    Raises:
        OSError: There is no room for the file in the folder.
    """
    handle, path = tempfile.mkstemp(prefix=_PREFIX, suffix=_SUFFIX, dir=folder)
    try:
        with os.fdopen(handle, "wb") as file:
            file.truncate(_TOTAL)
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, _TOTAL)
    except OSError:
        os.unlink(path)
        raise
    return path


def _offsets(capacities: Iterable[int]) -> list[int]:
    """Return the offset of each slot [bytes], with the ring's offset as the last entry."""
    offsets = [0]
    for capacity in capacities:
        # Each slot starts on its own cache line, so that the two writers do not slow each other.
        offsets.append(offsets[-1] + -(-Slot.size(capacity) // 64) * 64)
    return offsets


_TOTAL = _offsets(_SLOTS)[-1] + RowRing.size()
