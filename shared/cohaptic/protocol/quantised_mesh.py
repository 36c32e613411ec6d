"""Resting surface for a page that only shows it, with 16 bits for each coordinate of a vertex.

The frame has the kind of an exact rest mesh, flag 1, and a third to a half of the exact frame's
bytes. Faces are exact; a vertex is at most half a unit off on each axis, where a unit is the length
of the bounding box over 65,535. Vertices are predicted from their neighbours, as in a scene
(`scene_surface.py`).

Contacts are never computed with this mesh: a client that touches gets the exact one
(`rest_mesh.py`).
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import HEADER, MAX_POSITION, check_range, open_header
from cohaptic.protocol.layout import BOX, REST_MESH
from cohaptic.protocol.rest_mesh import COUNTS, MAX_BYTES, QUANTISED, check_counts, inflate
from cohaptic.protocol.scene_surface import fold, unfold
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.version import PROTOCOL_VERSION

STEPS = 2**16 - 1
_BOX = BOX.packer()
_HEAD = REST_MESH.size + BOX.size
# Tolerance for the far corner of a box that ends at MAX_POSITION, since its unit is rounded up to
# 32 bits.
_ROUNDING = 1e-6

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Places = npt.NDArray[np.uint16]


@dataclass(frozen=True, slots=True, eq=False)
class QuantisedMesh:
    """The resting surface in units of its bounding box.

    Args:
        low: Corner of the box with the smallest coordinates, 32 bits each, shape (3,) [m].
        unit: Unit of each axis, 32 bits each, shape (3,) [m]; 0 along an axis without extent.
        places: Positions of the vertices relative to `low`, shape (n, 3) [unit].
        faces: Indices of vertices, counter-clockwise seen from outside, shape (m, 3).
    """

    low: Floats
    unit: Floats
    places: Places
    faces: Ints

    @classmethod
    def of(cls, vertices: Floats, faces: Ints) -> QuantisedMesh:
        """The quantised mesh nearest to a mesh.

        Args:
            vertices: Shape (n, 3) [m].
            faces: Shape (m, 3).

        Raises:
            LocalProtocolError: A coordinate is beyond MAX_POSITION, or not finite.
        """
        largest = float(np.abs(vertices).max(initial=0.0))
        check_range("coordinate of a rest mesh", largest, 0.0, MAX_POSITION, remote=False)
        bottom, top = vertices.min(axis=0), vertices.max(axis=0)
        # Rounded outwards, so that the box holds every vertex.
        low = _single(bottom, -np.inf)
        unit = _single((top - low) / STEPS, np.inf)
        steps = np.divide(vertices - low, unit, out=np.zeros_like(vertices), where=unit > 0.0)
        return cls(low, unit, np.rint(steps).clip(0, STEPS).astype(np.uint16), faces)

    @property
    def vertices(self) -> Floats:
        """Positions of the vertices, shape (n, 3) [m]."""
        return self.low + self.unit * self.places

    @property
    def has_triangles_alone(self) -> bool:
        """Whether each face has three different corners; only such a mesh can be encoded."""
        return _triangles_alone(self.faces)

    def encode(self) -> bytes:
        """The frame of this mesh; raises LocalProtocolError when a value is out of its limits."""
        n, m = len(self.places), len(self.faces)
        check_counts(n, m, remote=False)
        _check(self.low, self.unit, self.faces, n, remote=False)
        corners = self.faces.astype("<u2").view(np.uint8).reshape(m, 3, 2).transpose(2, 1, 0)
        places = fold(self.places.view(np.int16), Traversal.of(n, self.faces))
        return (
            HEADER.pack(PROTOCOL_VERSION, FrameKind.REST_MESH, QUANTISED)
            + COUNTS.pack(n, m)
            + _BOX.pack(*self.low, *self.unit)
            + zlib.compress(corners.tobytes() + places)
        )

    @classmethod
    def decode(cls, data: bytes) -> QuantisedMesh:
        """The mesh in a frame; raises RemoteProtocolError for any invalid bytes."""
        flags = open_header(data, FrameKind.REST_MESH)
        check_range("flags of a quantised mesh", flags, QUANTISED, QUANTISED, remote=True)
        if not _HEAD < len(data) <= MAX_BYTES:
            limit = f"from {_HEAD + 1} to {MAX_BYTES} bytes"
            raise RemoteProtocolError("length of a quantised mesh", len(data), limit)
        n, m = COUNTS.unpack_from(data, HEADER.size)
        check_counts(n, m, remote=True)
        box = np.array(_BOX.unpack_from(data, REST_MESH.size))
        low, unit = box[:3], box[3:]
        raw = inflate(data[_HEAD:], 6 * (n + m))
        planes = np.frombuffer(raw[: 6 * m], np.uint8).reshape(2, 3, m)
        corners = np.ascontiguousarray(planes.transpose(2, 1, 0)).view("<u2")[:, :, 0]
        faces = corners.astype(np.int64)
        _check(low, unit, faces, n, remote=True)
        places = unfold(raw[6 * m :], Traversal.of(n, faces))
        return cls(low, unit, places.view(np.uint16), faces)


def _check(low: Floats, unit: Floats, faces: Ints, n: int, *, remote: bool) -> None:
    for start, size in zip(low.tolist(), (STEPS * unit).tolist(), strict=True):
        check_range("low end of a mesh's box", start, -MAX_POSITION, MAX_POSITION, remote=remote)
        limit = (MAX_POSITION - start) * (1.0 + _ROUNDING) + _ROUNDING
        check_range("size of a mesh's box", size, 0.0, limit, remote=remote)
    check_range("corner of a face", int(faces.min()), 0, n - 1, remote=remote)
    check_range("corner of a face", int(faces.max()), 0, n - 1, remote=remote)
    # The order of the vertices is defined for triangles only.
    check_range("triangles alone", _triangles_alone(faces), True, True, remote=remote)


def _triangles_alone(faces: Ints) -> bool:
    return bool((faces != faces[:, [1, 2, 0]]).all())


def _single(values: Floats, towards: float) -> Floats:
    """32-bit numbers equal to `values`, or next to them on the side of `towards`."""
    near = values.astype(np.float32)
    wrong_side = near > values if towards < 0.0 else near < values
    return np.where(wrong_side, np.nextafter(near, np.float32(towards)), near).astype(np.float64)
