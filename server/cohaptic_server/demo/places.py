"""Where hands stand on any body so that they feel each other.

A place must be free: nothing of the body in front of it within a hand's reach, nothing held near
it, the support behind it, and enough body under it to press into. Among such places a hand that
presses is felt where C_ij is large beside C_ii, and best where it is negative: there the surface
comes out when it presses, as on the other side of a water balloon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from cohaptic.errors import BodyError
from cohaptic.protocol.patch import MIN_COMPLIANCE
from cohaptic.simulated.hand import Place
from cohaptic_server.bodies.body import Body, Load
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.demo.scene import PRESS_DEPTH
from cohaptic_server.mesh.pressure import pressure
from cohaptic_server.mesh.sampling import spread_over
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.mesh.thickness import depth_under, is_smooth
from cohaptic_server.numeric import Floats, Ints

_LOOKED_AT = 400  # places, spread over the surface
_PRESSED = 6  # of them, to find what feels the press
_FINGER = 0.03  # m that a hand takes up, on the surface and in front of it
_PUSHED = 1.5  # how much more it counts to be pushed out than to sink in with the other
_SOFT = 1.5  # times the compliance of the median place, at most: a flap gives way and turns
_ENOUGH = 0.3  # of a coupling: of two places that have it the firmer one is better
_SHARE = 0.6  # of the way to the middle of the body that a hand wants to press at most


@dataclass(frozen=True, eq=False)
class Standing:
    """Places of hands on a body.

    Args:
        places: Of every hand, the one that presses first.
        depth: That the first wants to press [m].
        coupling: C_1j / C_jj of each hand with the first, shape (users,); 1 for itself. A force
            of the first moves the surface under hand j by this share of what j's own would.
        apart: Of each hand from the first [m].
    """

    places: tuple[Place, ...]
    depth: float
    coupling: tuple[float, ...]
    apart: tuple[float, ...]


def stand(body: Body, held: npt.NDArray[np.bool_], users: int) -> Standing:
    """Find places for `users` hands.

    Args:
        body: At rest.
        held: Which vertices of its surface do not move, shape (n,).
        users: How many.

    Raises:
        BodyError: There are not so many.
    """
    mesh = body.mesh
    room = min(_FINGER, 0.5 * mesh.size)
    apart = max(room, 3.0 * body.contact_radius)
    looked = spread_over(mesh.vertices, _LOOKED_AT)
    under = depth_under(mesh, looked)
    fit = is_smooth(mesh)[looked] & is_open(mesh, looked, room)
    fit &= under > 0.5 * np.median(under)
    fit &= supported(mesh, looked, held, 2.0 * body.contact_radius)
    soft = vertex_compliance(body)[looked]
    fit &= (soft > MIN_COMPLIANCE) & (soft <= _SOFT * np.median(soft[soft > MIN_COMPLIANCE]))
    free = looked[fit]
    if len(free) < users:
        raise BodyError(
            f"{body.name}: there is no place for {users} hands: {len(free)} of {len(looked)} places"
            " looked at are open, thick enough and away from what is held. Hold less of it"
        )
    pressed = free[spread_over(mesh.vertices[free], _PRESSED)]
    C_ii, C_ij = _felt(body, pressed, free)
    ratio = C_ij / C_ii[:, None]
    gap = np.linalg.norm(mesh.vertices[free][None] - mesh.vertices[pressed][:, None], axis=2)
    score = np.minimum(np.where(ratio < 0.0, -_PUSHED * ratio, ratio), _ENOUGH)
    score = score * (gap >= apart) * np.median(C_ii) / (C_ii[:, None] + soft[fit])
    first = int(np.argmax(np.sort(score, axis=1)[:, -(users - 1)]))
    chosen: list[int] = [int(pressed[first])]
    for k in np.argsort(-score[first]).tolist():
        off = mesh.vertices[chosen] - mesh.vertices[free[k]]
        if len(chosen) < users and np.linalg.norm(off, axis=1).min() >= apart:
            chosen.append(int(free[k]))
    if len(chosen) < users:
        raise BodyError(
            f"{body.name}: there is no room for {users} hands {1e3 * apart:.0f} mm apart; take"
            " fewer --users"
        )
    return _standing(body, np.array(chosen), float(under[np.isin(looked, chosen)].min()))


def is_open(mesh: SurfaceMesh, vertices: Ints, room: float) -> npt.NDArray[np.bool_]:
    """Whether a hand of `room` [m] finds the way to each vertex along its normal free."""
    steps = room * np.array([0.25, 0.5, 1.0, 1.5])
    out = mesh.vertices[vertices][:, None] + steps[:, None] * mesh.normals[vertices][:, None]
    return np.asarray((_distance(mesh, out) >= 0.6 * steps).all(axis=1))


def supported(
    mesh: SurfaceMesh, vertices: Ints, held: npt.NDArray[np.bool_], margin: float
) -> npt.NDArray[np.bool_]:
    """Whether what is held is further than `margin` [m] from each vertex, and behind it."""
    if not held.any():
        return np.ones(len(vertices), dtype=np.bool_)
    x = mesh.vertices[held]
    found = cKDTree(x).query(mesh.vertices[vertices])
    distance, nearest = np.asarray(found[0]), np.asarray(found[1])
    away = mesh.vertices[vertices] - x[nearest]
    ahead = np.einsum("ki,ki->k", away, mesh.normals[vertices])
    return np.asarray((distance > margin) & (ahead >= -0.1 * distance))


def _distance(mesh: SurfaceMesh, points: Floats) -> Floats:
    """From points to the nearest sample of the surface, shape points.shape[:-1] [m]."""
    return np.asarray(mesh.quadrature.tree.query(points)[0])


def _press(body: Body, vertex: int) -> Load:
    vertices, weights = pressure(body.mesh, body.mesh.vertices[vertex], body.contact_radius)
    return Load(vertices, weights, -body.mesh.normals[vertex], 0.0)


def _felt(body: Body, pressed: Ints, felt: Ints) -> tuple[Floats, Floats]:
    """C_ii of presses (p,), and how far they move other places inwards, (p, f) [m/N]."""
    response = body.respond([_press(body, int(k)) for k in pressed])
    inward = -body.mesh.normals[felt]
    C = np.empty((len(pressed), len(felt)))
    for i in range(len(pressed)):
        # Nothing presses yet: without a force of -1 N of this load there is 1 N of it.
        moved = response.without(slice(i, i + 1), np.array([-1.0]), felt)
        C[i] = np.einsum("fi,fi->f", moved, inward)
    return np.diag(response.compliance), C


def _standing(body: Body, chosen: Ints, under: float) -> Standing:
    C = body.respond([_press(body, int(k)) for k in chosen]).compliance
    x, inward = body.mesh.vertices[chosen], -body.mesh.normals[chosen]
    places = tuple(
        Place((float(p[0]), float(p[1]), float(p[2])), (float(n[0]), float(n[1]), float(n[2])))
        for p, n in zip(x, inward, strict=True)
    )
    return Standing(
        places,
        min(PRESS_DEPTH, _SHARE * under),
        tuple((C[0] / np.diag(C)).tolist()),
        tuple(np.linalg.norm(x - x[0], axis=1).tolist()),
    )
