"""A solid as seen from afar: its compliance between a few hundred places of its surface.

    C(x, y) ~ psi(x)' G psi(y),    G_pq: place p moves so far for a unit force at place q

G is exact, between contacts centred at places that are spread over the surface; psi carries a
force to the places round it and a displacement back, with its moments up to the second (moving
least squares), so that what is a few places away is right to third order. What it smooths
is the dent under the force itself: the compliance of a contact at its own place is therefore taken
from the places round it, where it is exact, and not from psi' G psi, which is less.

It stands in for columns that nobody has found yet, and for what lies too far from a contact for
them to matter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from cohaptic.errors import BodyError
from cohaptic_server.mesh.pressure import pressure
from cohaptic_server.mesh.sampling import spread_over
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints, cross

PLACES = 600
_AROUND = 16  # places that carry a vertex
_FACING = 0.3  # cosine between normals below which a place belongs to another side of the body
_BATCH = 16  # places in one solve
_AT_HOME = 0.1  # how near a place is at it, as the square of the share of the reach
_FLAT = 1e-5  # how little of a bending is believed, of all that is known
_ASKEW = 1e-4  # weight of a place of another side: it counts where there is no other

Solve = Callable[[Ints, Floats], Floats]  # as `GreenColumns.respond`
Narrow = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Carried:
    """A contact as the twin has it.

    Args:
        vertices: Under it, shape (k,).
        weights: Share of each, shape (k,).
        spread: Shares of the places, shape (m,).
        moved: Displacement of the places per unit force along x, y, z, shape (3, m, 3) [m/N].
    """

    vertices: Ints
    weights: Floats
    spread: Floats
    moved: Floats


@dataclass(frozen=True, eq=False)
class CoarseTwin:
    """What is known of a solid from afar.

    Args:
        places: Vertices of the surface, shape (m,).
        normals: Of the surface there, shape (m, 3).
        near: Places round each vertex, as indices into `places`, shape (n, k).
        means: Shares of them in what a vertex has of a smooth function, shape (n, k).
        carries: Shares that carry a force or a displacement of a vertex, shape (n, k).
        compliance: G, displacement of a place in x, y, z per unit force at another, averaged
            over the contacts' pressures, shape (3 m, 3 m) [m/N].
        spacing: Mean distance between places next to each other [m].
    """

    places: Ints
    normals: Floats
    near: Ints
    means: Floats
    carries: Floats
    compliance: Narrow
    spacing: float

    def spread(self, vertices: Ints, weights: Floats) -> Floats:
        """Shares of the places in a force on vertices, shape (m,)."""
        shares = weights[:, None] * self.carries[vertices]
        found = np.bincount(self.near[vertices].ravel(), shares.ravel(), len(self.places))
        return np.asarray(found, dtype=np.float64)

    def carry(self, vertices: Ints, weights: Floats) -> Carried:
        """What the twin has of a contact, whatever the direction of its force."""
        spread = self.spread(vertices, weights)
        used = np.flatnonzero(spread)
        rows = self.compliance.reshape(len(self.places), -1).take(used, 0)  # (u, 3 * 3 m)
        moved = np.dot(spread[used].astype(np.float32), rows)
        blocks = moved.reshape(3, -1, 3).astype(np.float64)
        return Carried(vertices, weights, spread, blocks)

    def pushed(self, spread: Floats, direction: Floats) -> Floats:
        """Displacement of the places per unit force, shape (m, 3) [m/N]."""
        used = np.flatnonzero(spread)
        rows = (3 * used[:, None] + np.arange(3)).ravel()
        force = (spread[used, None] * direction).ravel().astype(np.float32)
        moved = np.dot(force, self.compliance[rows])
        return np.asarray(moved, dtype=np.float64).reshape(-1, 3)

    def at(self, moved: Floats, vertices: Ints) -> Floats:
        """What vertices have of what the places have, such as a displacement.

        Args:
            moved: Of the places, shape (m, c).
            vertices: Shape (k,).

        Returns:
            Shape (k, c).
        """
        shares, near = self.carries.take(vertices, 0), self.near.take(vertices, 0)
        beside = moved.take(near.ravel(), 0).reshape(*near.shape, moved.shape[1])
        return np.asarray((shares[:, None, :] @ beside)[:, 0])

    def own(self, vertices: Ints, weights: Floats, direction: Floats, normal: Floats) -> float:
        """Compliance of a contact, from the contacts at the places round it [m/N].

        The surface is stiffer along its normal than across: a direction is turned with it.

        Args:
            vertices: Under the contact, shape (k,).
            weights: Share of each, shape (k,).
            direction: Of its force, shape (3,).
            normal: Of the surface there, shape (3,).
        """
        shares = (weights[:, None] * self.means[vertices]).ravel()
        used, place = np.unique(self.near[vertices].ravel(), return_inverse=True)
        turned = _turn(direction, normal, self.normals[used])  # (u, 3)
        along = np.einsum("ui,uij,uj->u", turned, self._own(used), turned)
        return max(0.0, float(shares @ along[place]))

    def table(self) -> Floats:
        """Compliance of a contact centred at each vertex, along its normal, shape (n,) [m/N]."""
        along = np.einsum(
            "pi,pij,pj->p", self.normals, self._own(np.arange(len(self.places))), self.normals
        )
        found: Floats = (self.means * along[self.near]).sum(axis=1)
        return np.maximum(0.0, found)

    def _own(self, places: Ints) -> Floats:
        """Compliance of each place at itself, shape (p, 3, 3) [m/N]."""
        rows = 3 * places[:, None] + np.arange(3)
        blocks = self.compliance[rows[:, :, None], rows[:, None, :]]
        return np.asarray(blocks, dtype=np.float64)

    def to_arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """For a file."""
        return {
            "places": self.places,
            "normals": self.normals,
            "near": self.near,
            "means": self.means,
            "carries": self.carries,
            "compliance": self.compliance,
            "spacing": np.array(self.spacing),
        }

    @classmethod
    def from_arrays(cls, found: dict[str, npt.NDArray[np.generic]]) -> CoarseTwin:
        """From a file; raises BodyError for one that is no twin."""
        try:
            return cls(
                np.asarray(found["places"], dtype=np.int64),
                np.asarray(found["normals"], dtype=np.float64),
                np.asarray(found["near"], dtype=np.int64),
                np.asarray(found["means"], dtype=np.float64),
                np.asarray(found["carries"], dtype=np.float64),
                np.asarray(found["compliance"], dtype=np.float32),
                float(np.asarray(found["spacing"], dtype=np.float64)),
            )
        except KeyError as error:
            raise BodyError(f"a stored object lacks {error}") from error


def make_twin(
    mesh: SurfaceMesh,
    radius: float,
    solve: Solve,
    held: npt.NDArray[np.bool_] | None = None,
    progress: Callable[[float], None] = lambda share: None,
    places: int = PLACES,
) -> CoarseTwin:
    """Press on every place once.

    Args:
        mesh: Resting surface.
        radius: Of the pressure under a contact [m].
        solve: Displacement of all vertices under forces on some, as `GreenColumns.respond`.
        held: Vertices that do not move, shape (n,); none if not given.
        progress: Told the share done.
        places: How many at most.
    """
    chosen = spread_over(mesh.vertices, places)
    under = [pressure(mesh, mesh.vertices[k], radius) for k in chosen]
    G = np.empty((3 * len(chosen), 3 * len(chosen)), dtype=np.float32)
    for start in range(0, len(chosen), _BATCH):
        batch = under[start : start + _BATCH]
        vertices = np.unique(np.concatenate([v for v, _ in batch]))
        forces = np.zeros((len(vertices), 3, 3 * len(batch)))
        for r, (v, w) in enumerate(batch):
            at = np.searchsorted(vertices, v)
            for axis in range(3):
                forces[at, axis, 3 * r + axis] = w
        moved = solve(vertices, forces).reshape(3 * len(batch), -1, 3)
        for p, (v, w) in enumerate(under):
            G[3 * start : 3 * (start + len(batch)), 3 * p : 3 * p + 3] = np.tensordot(
                moved[:, v], w, axes=(1, 0)
            )
        progress(min(1.0, (start + len(batch)) / len(chosen)))
    near, means, carries = _carriers(mesh, chosen, radius)
    if held is not None:
        carries[held] = 0.0
    return CoarseTwin(
        chosen,
        mesh.normals[chosen],
        near,
        means,
        carries,
        0.5 * (G + G.T),
        mesh.spacing(len(chosen)),
    )


def _carriers(mesh: SurfaceMesh, chosen: Ints, radius: float) -> tuple[Ints, Floats, Floats]:
    """Places round each vertex, and the shares of both kinds, (n, k) each.

    Shares of `means` reproduce quadratic functions in the tangent plane. Those of `carries` do so
    once each place is spread out by its pressure 1 - (r / radius)^2, of second moment radius^2 / 6:
    a force that the pressure of the places blurs again arrives with its moments as they were.
    Where every vertex is a place, each is its own.
    """
    x, n = mesh.vertices, mesh.normals
    k = min(_AROUND, len(chosen))
    # An array of neighbours, so that one of them still has an axis.
    near = np.asarray(cKDTree(x[chosen]).query(x, k=np.arange(1, k + 1))[1], dtype=np.int64)
    off = x[chosen][near] - x[:, None, :]  # (n, k, 3)
    distance = np.sqrt(np.einsum("vki,vki->vk", off, off))
    # All but zero at the farthest, so that places come and go without a step.
    reach = np.maximum(distance[:, -1:], 1e-12) * (1.0 + 1e-6)
    part = distance / reach
    # What is at a place is its own: far more than what is next to one.
    weights = ((1.0 - part) ** 4 * (4.0 * part + 1.0) + 1e-9) / (part * part + _AT_HOME)
    facing = np.einsum("vki,vi->vk", n[chosen][near], n)
    weights *= np.clip((facing - _FACING) / (1.0 - _FACING), _ASKEW, 1.0)
    # A basis of 1 and the two directions in the tangent plane.
    helper = np.eye(3)[np.abs(n).argmin(axis=1)]
    one = np.cross(n, helper)
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    two = np.cross(n, one)
    along, across = (np.einsum("vki,vi->vk", off, axis) / reach for axis in (one, two))
    basis = np.stack(
        [np.ones_like(along), along, across, along**2, along * across, across**2], axis=2
    )  # (n, k, 6)
    weighted = basis * weights[:, :, None]
    moments = np.einsum("vka,vkb->vab", weighted, basis)
    # Places in a row leave a direction open, a few of them the curvature: it then counts as flat.
    least = np.diag([0.0, 1e-6, 1e-6, _FLAT, _FLAT, _FLAT])
    moments += np.trace(moments, axis1=1, axis2=2)[:, None, None] * least
    target = np.zeros((len(x), 6, 2))
    target[:, 0] = 1.0
    target[:, [3, 5], 1] = -(radius**2) / 6.0 / reach**2
    solved = np.asarray(np.linalg.solve(moments, target), dtype=np.float64)
    shares: Floats = weighted @ solved  # (n, k, 2)
    shares /= shares.sum(axis=1, keepdims=True)
    if len(chosen) == len(x):
        shares[:] = (chosen[near] == np.arange(len(x))[:, None])[:, :, None]
    # Each in a piece of its own: rows are taken from them in every tick.
    return near, np.ascontiguousarray(shares[:, :, 0]), np.ascontiguousarray(shares[:, :, 1])


def _turn(direction: Floats, normal: Floats, others: Floats) -> Floats:
    """A direction turned as a normal is turned into others, the short way, shape (u, 3)."""
    cosine = others @ normal
    axis = cross(np.broadcast_to(normal, others.shape), others)
    # Rodrigues; opposite normals have no short way, and no place of the other side counts.
    along = axis @ direction
    scale = along / np.maximum(1.0 + cosine, 1e-3)
    across = cross(axis, np.broadcast_to(direction, axis.shape))
    return np.asarray(cosine[:, None] * direction + across + scale[:, None] * axis)
