"""The surface in a scene frame: the displacement of every vertex of the rest mesh, deflated.

Displacements are whole numbers with a common scale. Each number is replaced by its difference from
the prediction by its neighbours (`traversal.py`, modulo 2^16) and mapped to an unsigned number that
is small for small values of both signs (zigzag); low bytes are stored apart from high bytes. The
result is mostly zeros, which zlib compresses well at level 1. No frame depends on another.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.frame import MAX_POSITION, check_range, wrong
from cohaptic.protocol.layout import SURFACE
from cohaptic.protocol.traversal import Traversal

_HEAD = SURFACE.packer()
FINEST = 1e-5  # m; smaller than a pixel of any view of the body
MAX_SCALE = 0.1  # m; far above MAX_POSITION / MAX_UNITS
MAX_UNITS = 2**15 - 1
_LEVEL = 1  # of zlib; higher levels take several times as long to save a few percent
_SMALLEST = 2.0**-126  # smallest normal 32-bit number

Units = npt.NDArray[np.int16]


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Displacement from rest of every vertex of the rest mesh, in whole units.

    Args:
        scale: Length of one unit [m].
        units: Displacements in the order of the rest mesh's vertices, shape (n, 3) [scale].
    """

    scale: float
    units: Units

    @classmethod
    def of(cls, displacement: npt.NDArray[np.float64], finest: float = FINEST) -> Surface:
        """The surface nearest to `displacement`, shape (n, 3) [m].

        Args:
            displacement: Displacement from rest, shape (n, 3) [m].
            finest: Smallest unit; a larger one is used if the displacement does not fit [m].

        Raises:
            LocalProtocolError: The displacement is not finite, or exceeds MAX_POSITION.
        """
        largest = float(np.abs(displacement).max(initial=0.0))
        check_range("displacement of a surface", largest, 0.0, MAX_POSITION, remote=False)
        scale = _single(max(finest, largest / MAX_UNITS))
        return cls(scale, np.rint(displacement * (1.0 / scale)).astype(np.int16))

    @property
    def displacement(self) -> npt.NDArray[np.float64]:
        """Displacement of every vertex, shape (n, 3) [m]."""
        return self.scale * self.units.astype(np.float64)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Surface)
            and self.scale == other.scale
            and np.array_equal(self.units, other.units)
        )

    def __hash__(self) -> int:
        return hash((self.scale, self.units.tobytes()))

    def encode(self, traversal: Traversal) -> bytes:
        """The tail of a scene frame; raises LocalProtocolError if the scale is out of its limits.

        Args:
            traversal: Traversal of the rest mesh.
        """
        _check_scale(self.scale, remote=False)
        stream = zlib.compress(fold(self.units, traversal), _LEVEL)
        return _HEAD.pack(self.scale, len(stream)) + stream

    @classmethod
    def decode(cls, data: bytes, traversal: Traversal) -> Surface:
        """The surface in the tail of a frame; raises RemoteProtocolError for any invalid bytes.

        Args:
            data: Bytes of the frame from the scale on.
            traversal: Traversal of the rest mesh, which bounds the size that is inflated.
        """
        n = traversal.vertices
        if len(data) < _HEAD.size:
            raise RemoteProtocolError("surface length", len(data), f"at least {_HEAD.size} bytes")
        scale, length = _HEAD.unpack_from(data)
        _check_scale(scale, remote=True)
        if len(data) != _HEAD.size + length:
            limit = f"{_HEAD.size + length} bytes"
            raise RemoteProtocolError("surface length", len(data), limit)
        return cls(scale, unfold(_inflate(data[_HEAD.size :], 6 * n), traversal))


def fold(units: Units, traversal: Traversal) -> bytes:
    """Subtract from each unit its prediction, modulo 2^16; returns bytes that deflate well.

    Args:
        units: Units of each vertex, shape (n, 3).
    """
    units = np.concatenate([units, np.zeros((1, 3), np.int16)])
    predicted = units[traversal.p] + units[traversal.q] - units[traversal.r]
    steps = units[traversal.order] - predicted
    folded = ((steps << 1) ^ (steps >> 15)).astype("<u2", copy=False)
    # By component, then by byte: (2, 3, n).
    return folded.view(np.uint8).reshape(-1, 3, 2).transpose(2, 1, 0).tobytes()


def unfold(raw: bytes, traversal: Traversal) -> Units:
    """The units that `fold` turned into these bytes, shape (n, 3).

    Args:
        raw: 6 n bytes.
    """
    n = traversal.vertices
    planes = np.frombuffer(raw, np.uint8).reshape(2, 3, n)
    folded = np.ascontiguousarray(planes.transpose(2, 1, 0)).view("<u2")[:, :, 0]
    steps = (folded >> 1).astype(np.int16) ^ -(folded & 1).astype(np.int16)
    units = np.zeros((n + 1, 3), np.int16)  # the last row stands for zero
    for v, p, q, r, step in zip(
        *(a.tolist() for a in (traversal.order, traversal.p, traversal.q, traversal.r)),
        steps,
        strict=True,
    ):
        units[v] = units[p] + units[q] - units[r] + step
    return units[:n]


def _check_scale(scale: float, *, remote: bool) -> None:
    check_range("scale of a surface", scale, 0.0, MAX_SCALE, remote=remote)
    if scale < _SMALLEST:
        raise wrong("scale of a surface", scale, "above 0", remote=remote)


def _inflate(deflated: bytes, size: int) -> bytes:
    """The inflated bytes; raises RemoteProtocolError unless they are exactly `size` bytes."""
    stream = zlib.decompressobj()
    try:
        raw = stream.decompress(deflated, size + 1)
    except zlib.error as error:
        raise RemoteProtocolError("content of a surface", str(error), "a zlib stream") from error
    if len(raw) != size or not stream.eof or stream.unused_data:
        size_found = "more" if len(raw) > size or stream.unused_data else len(raw)
        raise RemoteProtocolError("inflated size of a surface", size_found, f"{size} bytes")
    return raw


def _single(value: float) -> float:
    """The 32-bit number nearest to `value`."""
    return float(np.float32(value))
