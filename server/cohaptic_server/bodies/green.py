"""Green's functions of a body, encoded for a web page, and the name under which it caches them.

A Green's function is the displacement of all vertices for a unit force on one vertex. The
displacement of a linear body is the sum of these functions, each times the force on its vertex. A
page that has these functions needs only the forces. The functions depend on the body alone: their
name is a hash of the body, so a copy from any server stays valid.
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
    8  # vertices with a force, to identify a body: every function depends on the whole body
)


class GreenSource(Protocol):
    """Source of Green's functions; its methods run in another thread than the tick."""

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        ...

    def green(self, vertex: int) -> Floats:
        """Return the displacement of all vertices per unit force on one, (3, n, 3) [m/N].

        The first axis is the direction of the force: x, y, z.
        """
        ...

    def identity(self) -> bytes:
        """Return bytes that differ between bodies of one mesh if stiffness or support differs."""
        ...


class Linear(Protocol):
    """A linear body whose response stores the displacement of every vertex."""

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        ...

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        """Return the equilibrium of the body under `loads`."""
        ...


class Superposition:
    """Green's functions of a linear body, computed as its responses to unit forces.

    Args:
        body: A linear body without memory; `respond` must not change it.
    """

    def __init__(self, body: Linear) -> None:
        self._body = body

    @property
    def mesh(self) -> SurfaceMesh:
        """The resting surface."""
        return self._body.mesh

    def green(self, vertex: int) -> Floats:
        """Return the displacement of all vertices per unit force on one, (3, n, 3) [m/N].

        The first axis is the direction of the force: x, y, z.
        """
        return self._spread(np.array([vertex]), np.ones(1))

    def identity(self) -> bytes:
        """Return the encoded displacement of all vertices under forces on a few, from one solve."""
        n = len(self.mesh.vertices)
        vertices = np.unique(np.linspace(0, n - 1, _SIGNATURE).astype(np.int64))
        return encode_block(self._spread(vertices, np.arange(1.0, len(vertices) + 1.0)))

    def _spread(self, vertices: Ints, weights: Floats) -> Floats:
        """Return the displacement of all vertices under some forces, (3, n, 3) [m].

        The forces on `vertices` are `weights` [N], in three load cases along x, y and z.
        """
        loads = [Load(vertices, weights, axis, 0.0) for axis in np.eye(3)]
        return self._body.respond(loads).fields


@runtime_checkable
class HasGreen(Protocol):
    """A body that may be described by its Green's functions."""

    def green_source(self) -> GreenSource | None:
        """Return the source of the functions; None if the displacement is not a sum of them."""
        ...


def green_source(body: Body) -> GreenSource | None:
    """Return the source of a body's Green's functions; None if they do not describe the body."""
    return body.green_source() if isinstance(body, HasGreen) else None


def encode_block(green: Floats) -> bytes:
    """Encode the Green's functions of one vertex as a scale and 16 bits per number.

    Args:
        green: Green's functions of the vertex, shape (3, n, 3) [m/N].
    """
    # The scale is rounded up to the next 32-bit float, so that the largest value fits 16 bits.
    scale = float(np.nextafter(np.float32(np.abs(green).max() / _UNITS), np.float32(np.inf)))
    return _HEAD.pack(scale) + np.rint(green / scale).astype("<i2").tobytes()


def decode_block(data: bytes) -> Floats:
    """Return the Green's functions that `encode_block` encoded, shape (3, n, 3) [m/N]."""
    (scale,) = _HEAD.unpack_from(data)
    units = np.frombuffer(data, "<i2", offset=_HEAD.size).astype(np.float64)
    return np.asarray(scale * units.reshape(3, -1, 3))


def model_name(source: GreenSource) -> str:
    """Return the name of a body's Green's functions: a hash of 32 hexadecimal digits.

    The hash covers the mesh and `identity`.
    """
    content = hashlib.sha256()
    content.update(source.mesh.vertices.astype("<f4").tobytes())
    content.update(source.mesh.faces.astype("<u4").tobytes())
    content.update(source.identity())
    return content.hexdigest()[:32]
