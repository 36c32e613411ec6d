"""The tail of a mesh patch: the free surface around the contact, vertex by vertex.

The client has the resting mesh (`rest_mesh.py`); a vertex here is its number, its displacement
without this client's own force, and the compliance of a contact centred on it. The values are whole
numbers with a common scale, as on the wire, so that both sides hold the same numbers.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.frame import MAX_POSITION, check_range, wrong
from cohaptic.vec import Vec3

_HEAD = struct.Struct("<Hff")
_ITEM_FORMAT = "H3hH"
_ITEM = struct.Struct(f"<{_ITEM_FORMAT}")
MAX_VERTICES = 97  # 1,108 bytes with a patch that carries its compliance too, below 1,120
_SMALLEST = 2.0**-126
_I16 = 2**15 - 1
_U16 = 2**16 - 1


@dataclass(init=False)
class Neighbourhood:
    """Vertices of the resting mesh with their present displacements, by rising index.

    Args:
        scale: One unit of `displacements` [m].
        c_scale: One unit of `compliances` [m/N].
        indices: Of the vertices in the resting mesh, rising, shape (k,).
        displacements: Without this client's own force, shape (k, 3) [scale].
        compliances: Of a contact centred at each vertex, along its normal, shape (k,) [c_scale].
    """

    scale: Final[float]
    c_scale: Final[float]
    indices: Final[tuple[int, ...]]
    displacements: Final[tuple[tuple[int, int, int], ...]]
    compliances: Final[tuple[int, ...]]

    def __init__(
        self,
        scale: float,
        c_scale: float,
        indices: tuple[int, ...],
        displacements: tuple[tuple[int, int, int], ...],
        compliances: tuple[int, ...],
    ) -> None:
        self.scale = scale
        self.c_scale = c_scale
        self.indices = indices
        self.displacements = displacements
        self.compliances = compliances

    @classmethod
    def of(
        cls, indices: Sequence[int], displacements: Sequence[Vec3], c_ii: Sequence[float]
    ) -> Neighbourhood:
        """The neighbourhood with these values, rounded to its units.

        Args:
            indices: Rising, shape (k,).
            displacements: Shape (k, 3) [m].
            c_ii: Shape (k,) [m/N].
        """
        most = max((abs(u) for v in displacements for u in v), default=0.0)
        scale, c_scale = cls.scales(most, max(c_ii, default=0.0))
        per, c_per = 1.0 / scale if scale else 0.0, 1.0 / c_scale if c_scale else 0.0
        return cls(
            scale,
            c_scale,
            tuple(indices),
            tuple((round(per * x), round(per * y), round(per * z)) for x, y, z in displacements),
            tuple(round(c_per * c) for c in c_ii),
        )

    @staticmethod
    def scales(displacement: float, c_ii: float) -> tuple[float, float]:
        """Units [m], [m/N] that hold values up to these [m], [m/N]."""
        return _single(displacement / _I16), _single(c_ii / _U16)

    def encode(self) -> bytes:
        """The tail of the frame; raises LocalProtocolError when a value is out of its limits."""
        self._check(remote=False)
        units = [u for v in self.displacements for u in v]
        for worst in (min(units, default=0), max(units, default=0)):
            check_range("displacement of a vertex", worst, -_I16 - 1, _I16, remote=False)
        for worst in (min(self.compliances, default=0), max(self.compliances, default=0)):
            check_range("compliance of a vertex", worst, 0, _U16, remote=False)
        return _HEAD.pack(len(self.indices), self.scale, self.c_scale) + b"".join(
            _ITEM.pack(i, *u, c)
            for i, u, c in zip(self.indices, self.displacements, self.compliances, strict=True)
        )

    @classmethod
    def decode(cls, data: bytes) -> Neighbourhood:
        """The neighbourhood in a tail; raises RemoteProtocolError for any invalid bytes."""
        if len(data) < _HEAD.size:
            limit = f"at least {_HEAD.size} bytes"
            raise RemoteProtocolError("length of a neighbourhood", len(data), limit)
        count, scale, c_scale = _HEAD.unpack_from(data)
        check_range("vertices of a neighbourhood", count, 0, MAX_VERTICES, remote=True)
        size = _HEAD.size + count * _ITEM.size
        if len(data) != size:
            raise RemoteProtocolError("length of a neighbourhood", len(data), f"{size} bytes")
        # All at once, then by columns: the loop has a fraction of a period for this.
        values = struct.unpack_from(f"<{count * _ITEM_FORMAT}", data, _HEAD.size)
        indices, x, y, z, compliances = [values[i::5] for i in range(5)]
        neighbourhood = cls(scale, c_scale, indices, tuple(zip(x, y, z, strict=True)), compliances)
        neighbourhood._check(remote=True)
        return neighbourhood

    def _check(self, *, remote: bool) -> None:
        count = len(self.indices)
        check_range("vertices of a neighbourhood", count, 0, MAX_VERTICES, remote=remote)
        check_range("scale of a neighbourhood", self.scale, 0.0, MAX_POSITION / _I16, remote=remote)
        limit = MAX_POSITION / _U16
        check_range("c_scale of a neighbourhood", self.c_scale, 0.0, limit, remote=remote)
        # A strict order leaves no vertex twice.
        before = -1
        for i in self.indices:
            if i <= before:
                limits = f"more than the one before, {before}"
                raise wrong("index of a vertex", i, limits, remote=remote)
            before = i
        check_range("index of a vertex", max(self.indices, default=0), 0, _U16, remote=remote)


def _single(x: float) -> float:
    """The next 32-bit number that is not below x: the largest value must fit its integer.

    Below the smallest normal 32-bit number it is 0.
    """
    if x < _SMALLEST:
        return 0.0
    return float(struct.unpack("<f", struct.pack("<f", x * (1.0 + 1e-7)))[0])
