"""Green's functions of a body as a page gets them, and the name under which they are cached.

The displacement of a linear body is a sum over vertices: the displacement for a unit force on a
vertex, times the force on it. A page that has these functions needs only the forces. They depend on
the body alone, so they are named by its content and can be cached for ever, whoever serves them.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from cohaptic_server.bodies.body import Body, DenseResponse, Load, Response
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints

_HEAD = struct.Struct("<f")
_UNITS = 2**15 - 1
_SIGNATURE = (
    8  # vertices that are pressed together to tell a body: all functions depend on all of it
)


class GreenSource(Protocol):
    """Source of Green's functions; it is called in another thread than the tick's."""

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        ...

    def green(self, vertex: int) -> Floats:
        """Displacement of all vertices per unit force on one, along x, y, z, (3, n, 3) [m/N]."""
        ...

    def identity(self) -> bytes:
        """What distinguishes bodies of the same mesh: stiffness, support."""
        ...


class Linear(Protocol):
    """A body whose response has the displacement of every vertex."""

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        ...

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        """Equilibrium of the body with `loads`."""
        ...


class Superposition:
    """Green's functions of a linear body, from its responses to unit forces.

    Args:
        body: Linear and without memory; `respond` must not change it.
    """

    def __init__(self, body: Linear) -> None:
        self._body = body

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        return self._body.mesh

    def green(self, vertex: int) -> Floats:
        """Displacement of all vertices per unit force on one, shape (3, n, 3) [m/N]."""
        return self._spread(np.array([vertex]), np.ones(1))

    def identity(self) -> bytes:
        """The displacement by forces on a few vertices, found in one solve."""
        n = len(self.mesh.vertices)
        vertices = np.unique(np.linspace(0, n - 1, _SIGNATURE).astype(np.int64))
        return encode_block(self._spread(vertices, np.arange(1.0, len(vertices) + 1.0)))

    def _spread(self, vertices: Ints, weights: Floats) -> Floats:
        """Displacement for forces of the given sizes on vertices, shape (3, n, 3) [m]."""
        loads = [Load(vertices, weights, axis, 0.0) for axis in np.eye(3)]
        return self._body.respond(loads).fields


@runtime_checkable
class HasGreen(Protocol):
    """A body that may be known by its Green's functions."""

    def green_source(self) -> GreenSource | None:
        """Where its Green's functions come from; None while its displacement is no sum of them."""
        ...


def green_source(body: Body) -> GreenSource | None:
    """Green's functions of a body; None where its displacement is no sum of them."""
    return body.green_source() if isinstance(body, HasGreen) else None


def encode_block(green: Floats) -> bytes:
    """Encode the functions of one vertex: a scale, then 16 bits per number.

    Args:
        green: Shape (3, n, 3) [m/N].
    """
    # Rounded up to the next 32-bit float, so that the largest value fits its integer.
    scale = float(np.nextafter(np.float32(np.abs(green).max() / _UNITS), np.float32(np.inf)))
    return _HEAD.pack(scale) + np.rint(green / scale).astype("<i2").tobytes()


def decode_block(data: bytes) -> Floats:
    """Decode the functions of one vertex, shape (3, n, 3) [m/N]."""
    (scale,) = _HEAD.unpack_from(data)
    units = np.frombuffer(data, "<i2", offset=_HEAD.size).astype(np.float64)
    return np.asarray(scale * units.reshape(3, -1, 3))


def model_name(source: GreenSource) -> str:
    """Hash of the resting mesh and of what tells the body from others, 32 hexadecimal digits."""
    content = hashlib.sha256()
    content.update(source.mesh.vertices.astype("<f4").tobytes())
    content.update(source.mesh.faces.astype("<u4").tobytes())
    content.update(source.identity())
    return content.hexdigest()[:32]
