"""The tail of a mesh patch: the free surface around the contact, vertex by vertex.

The client has the resting mesh (`rest_mesh.py`); here a vertex consists of its number, its
displacement without this client's own force, and the compliance of a contact centred on it. The
values are whole numbers with a common scale. They are kept as the bytes of the wire, so that both
sides hold the same numbers and a server can pack its arrays at once; the properties unpack them.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.frame import MAX_POSITION, check_range, wrong
from cohaptic.protocol.layout import NEIGHBOUR, NEIGHBOURHOOD
from cohaptic.vec import Vec3

_HEAD: Final = NEIGHBOURHOOD.packer()
_ITEM: Final = NEIGHBOUR.packer()
_ITEM_CODES: Final = NEIGHBOUR.codes
ITEM_SIZE: Final = NEIGHBOUR.size
MAX_VERTICES: Final = 97  # 1,108 bytes with a patch that carries the 3x3 compliance, below 1,120
_SMALLEST: Final = 2.0**-126
_I16: Final = 2**15 - 1
_U16: Final = 2**16 - 1


@dataclass(init=False)
class Neighbourhood:
    """Vertices of the resting mesh with their present displacements, in order of their index.

    Args:
        scale: One unit of `displacements` [m].
        c_scale: One unit of `compliances` [m/N].
        items: Number, displacement and compliance of each of k vertices as on the wire, packed
            little-endian in `ITEM_SIZE` bytes: u16, 3 i16, u16.
    """

    scale: Final[float]
    c_scale: Final[float]
    items: Final[bytes]

    def __init__(self, scale: float, c_scale: float, items: bytes) -> None:
        self.scale = scale
        self.c_scale = c_scale
        self.items = items

    @classmethod
    def of(
        cls, indices: Sequence[int], displacements: Sequence[Vec3], c_ii: Sequence[float]
    ) -> Neighbourhood:
        """The neighbourhood with the given values, rounded to its units.

        Args:
            indices: Rising indices of the vertices, shape (k,).
            displacements: Displacements of the vertices, shape (k, 3) [m].
            c_ii: Compliances of a contact at each vertex, shape (k,) [m/N].

        Raises:
            LocalProtocolError: A value is out of its limits.
        """
        largest = max((abs(u) for v in displacements for u in v), default=0.0)
        scale, c_scale = cls.scales(largest, max(c_ii, default=0.0))
        per, c_per = 1.0 / scale if scale else 0.0, 1.0 / c_scale if c_scale else 0.0
        return cls.of_units(
            scale,
            c_scale,
            indices,
            [(round(per * x), round(per * y), round(per * z)) for x, y, z in displacements],
            [round(c_per * c) for c in c_ii],
        )

    @classmethod
    def of_units(
        cls,
        scale: float,
        c_scale: float,
        indices: Sequence[int],
        displacements: Sequence[tuple[int, int, int]],
        compliances: Sequence[int],
    ) -> Neighbourhood:
        """The neighbourhood with the given whole numbers.

        Args:
            scale: One unit of `displacements` [m].
            c_scale: One unit of `compliances` [m/N].
            indices: Rising indices of the vertices, shape (k,).
            displacements: Displacements of the vertices, shape (k, 3) [scale].
            compliances: Compliances of a contact at each vertex, shape (k,) [c_scale].

        Raises:
            LocalProtocolError: A value is out of its limits.
        """
        _check_rising(indices, remote=False)
        for u in (u for v in displacements for u in v):
            check_range("displacement of a vertex", u, -_I16 - 1, _I16, remote=False)
        for c in compliances:
            check_range("compliance of a vertex", c, 0, _U16, remote=False)
        items = zip(indices, displacements, compliances, strict=True)
        return cls(scale, c_scale, b"".join(_ITEM.pack(i, *u, c) for i, u, c in items))

    @staticmethod
    def scales(displacement: float, c_ii: float) -> tuple[float, float]:
        """`scale` [m] and `c_scale` [m/N] for values up to `displacement` [m] and `c_ii` [m/N]."""
        return _single(displacement / _I16), _single(c_ii / _U16)

    @property
    def indices(self) -> tuple[int, ...]:
        """Indices of the vertices in the resting mesh, rising, shape (k,)."""
        return self._numbers()[0::5]

    @property
    def displacements(self) -> tuple[tuple[int, int, int], ...]:
        """Displacements without this client's own force, shape (k, 3) [scale]."""
        numbers = self._numbers()
        return tuple(zip(numbers[1::5], numbers[2::5], numbers[3::5], strict=True))

    @property
    def compliances(self) -> tuple[int, ...]:
        """Compliance of a contact at each vertex, along its normal, shape (k,) [c_scale]."""
        return self._numbers()[4::5]

    def _numbers(self) -> tuple[int, ...]:
        """All numbers of the items, unpacked at once to save time in the haptic loop."""
        return struct.unpack(f"<{len(self.items) // ITEM_SIZE * _ITEM_CODES}", self.items)

    def encode(self) -> bytes:
        """The tail of a patch frame; raises LocalProtocolError if a value is out of its limits."""
        self._check(remote=False)
        return _HEAD.pack(len(self.items) // ITEM_SIZE, self.scale, self.c_scale) + self.items

    @classmethod
    def decode(cls, data: bytes) -> Neighbourhood:
        """The neighbourhood in a frame's tail; raises RemoteProtocolError for any invalid bytes."""
        if len(data) < _HEAD.size:
            limit = f"at least {_HEAD.size} bytes"
            raise RemoteProtocolError("length of a neighbourhood", len(data), limit)
        count, scale, c_scale = _HEAD.unpack_from(data)
        check_range("vertices of a neighbourhood", count, 0, MAX_VERTICES, remote=True)
        size = _HEAD.size + count * ITEM_SIZE
        if len(data) != size:
            raise RemoteProtocolError("length of a neighbourhood", len(data), f"{size} bytes")
        neighbourhood = cls(scale, c_scale, data[_HEAD.size :])
        neighbourhood._check(remote=True)
        _check_rising(neighbourhood.indices, remote=True)
        return neighbourhood

    @classmethod
    def decode_checked(cls, data: bytes) -> Neighbourhood:
        """The neighbourhood in a tail that `decode` has accepted before; values are not checked."""
        _, scale, c_scale = _HEAD.unpack_from(data)
        return cls(scale, c_scale, data[_HEAD.size :])

    def _check(self, *, remote: bool) -> None:
        """Check count and scales; the indices are checked where items are packed or decoded."""
        count = len(self.items) // ITEM_SIZE
        check_range("vertices of a neighbourhood", count, 0, MAX_VERTICES, remote=remote)
        check_range("scale of a neighbourhood", self.scale, 0.0, _MAX_SCALE, remote=remote)
        check_range("c_scale of a neighbourhood", self.c_scale, 0.0, _MAX_C_SCALE, remote=remote)


def _check_rising(indices: Sequence[int], *, remote: bool) -> None:
    """Raise unless the indices rise strictly, so that no vertex comes twice, and fit 16 bits."""
    before = -1
    for i in indices:
        if i <= before:
            limits = f"more than the one before, {before}"
            raise wrong("index of a vertex", i, limits, remote=remote)
        before = i
    check_range("index of a vertex", max(before, 0), 0, _U16, remote=remote)


def _single(x: float) -> float:
    """A 32-bit number just above x, so that the largest value fits its integer.

    Returns 0 if x is below the smallest normal 32-bit number.
    """
    if x < _SMALLEST:
        return 0.0
    return float(struct.unpack("<f", struct.pack("<f", x * (1.0 + 1e-7)))[0])


# Units for the largest values, themselves rounded up to 32 bits.
_MAX_SCALE: Final = _single(MAX_POSITION / _I16)
_MAX_C_SCALE: Final = _single(MAX_POSITION / _U16)
