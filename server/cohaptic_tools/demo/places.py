"""Finds places on the surface of any body at which hands feel each other.

At an admissible place no other part of the body is within a hand's width in front of the surface,
no fixed vertex is near, the fixed part lies behind the surface, and the body is thick enough to
press into. C_ii is the compliance at a pressed place i, and C_ij the displacement at place j per
force at i [m/N], both inwards. The pressing hand is felt most where C_ij is large relative to C_ii,
and best where C_ij is negative: there a press moves the surface outwards, as on the far side of a
balloon. From these compliances follow the forces of two hands (`felt.py`), and the pair is taken on
the stiffest places at which both hands feel enough of each other.

Places near a rim are not admissible, since a finger there would touch the neighbouring face
instead.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from cohaptic.control.friction import tangents
from cohaptic.errors import BodyError
from cohaptic.protocol.patch import MIN_COMPLIANCE
from cohaptic.simulated.hand import Place
from cohaptic_server.bodies.body import Body, Load
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.mesh.surface import SurfaceMesh, pressure, spread_over
from cohaptic_server.mesh.thin_parts import depth_under, is_smooth
from cohaptic_server.numeric import Floats, Ints, vec3
from cohaptic_server.world.contact import locate
from cohaptic_server.world.displacement_field import ZeroField
from cohaptic_tools.demo.felt import RENDERED, PairForces, expected, fitting_depth
from cohaptic_tools.demo.scene import PRESS_DEPTH
from cohaptic_tools.demo.settled import Placement, first_that_rests

_CANDIDATES = 400  # vertices, spread over the surface
_PRESSED = 6  # admissible candidates at which a press is tried
_FINGER = 0.03  # m; width of a hand, along the surface and in front of it
_MAX_COMPLIANCE = 1.5  # relative to the median candidate: a softer place is a flap that bends
_STIFFEST = 0.9 * RENDERED  # N/m; stiffer places are taken only where there are no others
# Forces over those that are just felt; more count as this, so that the stiffer place is preferred.
_CLEARLY = 2.0
# Least distance to the held region, in contact radii; the next value is tried if there are too few
# places. On a frame of thin tubes that lies on its side, only protruding parts are further away
# from the held region than a few contact radii.
_FROM_HELD = (2.0, 1.0, 0.5)
# Least distance between two hands, in contact radii; the next value is tried if there is no room.
# At 2 radii two contacts on the same side meet; on a bottle of 133 tetrahedra with a fingertip of
# 28 mm there is no place further away.
_APART = (3.0, 2.2, 1.5)
_MAX_DEPTH = 0.6  # largest depth of a press over the thickness of the body at the place
# A thin wall yields as a whole, so that a hand may press deeper than the wall is thick: until hands
# feel each other, but at most by this share of `SurfaceMesh.size`. Without this rule two hands on a
# bottle's wall of 1.2 mm felt 3 mN.
_MAX_FRACTION = 0.15


def _silent(fraction: float) -> None:
    """Ignore the completed fraction; the default for a progress callback."""


def place_hands(
    body: Body, held: npt.NDArray[np.bool_], users: int, progress: Callable[[float], None] = _silent
) -> Placement:
    """Return a placement of `users` hands at which they come to rest.

    Args:
        body: The body at rest.
        held: Whether each vertex of the surface is fixed, shape (n,).
        users: Number of hands.
        progress: Called with the completed fraction, 0 to 1.

    Raises:
        BodyError: There are not enough admissible places.
    """
    return first_that_rests(body, placements(body, held, users), progress)


def placements(body: Body, held: npt.NDArray[np.bool_], users: int) -> list[Placement]:
    """Return possible placements of the hands, the best first.

    Args:
        body: The body at rest.
        held: Whether each vertex of the surface is fixed, shape (n,).
        users: Number of hands.

    Raises:
        BodyError: There are not enough admissible places.
    """
    mesh = body.mesh
    room = width_of_hand(mesh)
    candidates = spread_over(mesh.vertices, _CANDIDATES)
    under = depth_under(mesh, candidates)
    fit = is_smooth(mesh)[candidates] & is_open(mesh, candidates, room)
    fit &= under > 0.5 * np.median(under)
    soft = vertex_compliance(body, candidates)
    fit &= (soft > MIN_COMPLIANCE) & (
        soft <= _MAX_COMPLIANCE * np.median(soft[soft > MIN_COMPLIANCE])
    )
    rendered = fit & (soft >= 1.0 / _STIFFEST)
    fit = rendered if rendered.sum() >= _PRESSED else fit
    # A flat object that lies on its held region may have no place far away from it.
    away = fit
    for radii in _FROM_HELD:
        away = fit & supported(mesh, candidates, held, radii * body.contact_radius)
        away[away] = is_met_squarely(body, candidates[away])
        if away.sum() >= users:
            break
    admissible = candidates[away]
    if len(admissible) < users:
        raise BodyError(
            f"{body.name}: there is no place for {users} hands: {len(admissible)} of"
            f" {len(candidates)} places looked at are open, thick enough and away from what is"
            " held. Hold less of it"
        )
    first = spread_over(mesh.vertices[admissible], _PRESSED)
    pressed, thick = admissible[first], under[away]
    C_ii, C_ij = _coupling(body, pressed, admissible)
    pairs = expected(C_ii[:, None], C_ij, soft[away])
    depth = _depth(pairs, np.minimum(thick[first][:, None], thick), mesh)
    gap = np.linalg.norm(mesh.vertices[admissible][None] - mesh.vertices[pressed][:, None], axis=2)
    score = np.minimum(depth * pairs.enough, _CLEARLY)
    score = score * np.median(C_ii) / (C_ii[:, None] + soft[away])
    least = [max(room, radii * body.contact_radius) for radii in _APART]
    each = (
        _groups(mesh.vertices, pressed, admissible, score * (gap >= d), users, d) for d in least
    )
    groups = next(filter(None, each), None)
    if groups is None:
        raise BodyError(
            f"{body.name}: there is no room for {users} hands {1e3 * least[-1]:.0f} mm apart; take"
            " fewer --users"
        )
    return [
        placement_at(body, chosen, float(under[np.isin(candidates, chosen)].min()), felt=True)
        for chosen in groups
    ]


def _groups(
    x: Floats, pressed: Ints, admissible: Ints, score: Floats, users: int, apart: float
) -> list[Ints]:
    """Return groups of one vertex for each hand, the best group first; the first hand presses.

    Args:
        x: Positions of the vertices, shape (n, 3) [m].
        pressed: Vertices at which a press was tried, shape (p,).
        admissible: Vertices at which the other hands may stand, shape (f,).
        score: Score of each pressed vertex with each admissible one, shape (p, f).
        users: Number of hands.
        apart: Least distance between two hands [m].
    """
    found: list[Ints] = []
    for first in np.argsort(-np.sort(score, axis=1)[:, -(users - 1)], kind="stable").tolist():
        chosen: list[int] = [int(pressed[first])]
        for k in np.argsort(-score[first]).tolist():
            off = x[chosen] - x[admissible[k]]
            if len(chosen) < users and np.linalg.norm(off, axis=1).min() >= apart:
                chosen.append(int(admissible[k]))
        if len(chosen) == users:
            found.append(np.array(chosen))
    return found


def width_of_hand(mesh: SurfaceMesh) -> float:
    """Return the space that a hand takes along and in front of a surface of this size [m]."""
    return min(_FINGER, 0.5 * mesh.size)


def is_open(mesh: SurfaceMesh, vertices: Ints, room: float) -> npt.NDArray[np.bool_]:
    """Whether a hand of width `room` [m] can reach each vertex along its normal, shape (k,)."""
    steps = room * np.array([0.25, 0.5, 1.0, 1.5])
    out = mesh.vertices[vertices][:, None] + steps[:, None] * mesh.normals[vertices][:, None]
    return np.asarray((_distance(mesh, out) >= 0.6 * steps).all(axis=1))


def supported(
    mesh: SurfaceMesh, vertices: Ints, held: npt.NDArray[np.bool_], margin: float
) -> npt.NDArray[np.bool_]:
    """Whether the fixed vertex nearest to each of k vertices is far enough and behind, (k,).

    Args:
        mesh: Surface of the body.
        vertices: Vertices to test, shape (k,).
        held: Whether each vertex of the surface is fixed, shape (n,).
        margin: Least distance to the nearest fixed vertex [m].
    """
    if not held.any():
        return np.ones(len(vertices), dtype=np.bool_)
    x = mesh.vertices[held]
    distance, nearest = map(np.asarray, cKDTree(x).query(mesh.vertices[vertices]))
    away = mesh.vertices[vertices] - x[nearest]
    ahead = np.einsum("ki,ki->k", away, mesh.normals[vertices])
    return np.asarray((distance > margin) & (ahead >= -0.1 * distance))


def _distance(mesh: SurfaceMesh, points: Floats) -> Floats:
    """Return the distance of points to the nearest surface sample, shape points.shape[:-1] [m]."""
    return np.asarray(mesh.quadrature.tree.query(points)[0])


def _press(body: Body, vertex: int) -> Load:
    vertices, weights = pressure(
        body.mesh, body.mesh.vertices[vertex], body.contact_radius, body.mesh.normals[vertex]
    )
    return Load(vertices, weights, -body.mesh.normals[vertex], 0.0)


def _coupling(body: Body, pressed: Ints, felt: Ints) -> tuple[Floats, Floats]:
    """Return C_ii at each pressed vertex, shape (p,), and C_ij at the felt ones, (p, f) [m/N]."""
    response = body.respond([_press(body, int(k)) for k in pressed])
    inward = -body.mesh.normals[felt]
    C = np.empty((len(pressed), len(felt)))
    for i in range(len(pressed)):
        # Removing a force of -1 N is the same as applying 1 N.
        moved = response.without(slice(i, i + 1), np.array([-1.0]), felt)
        C[i] = np.einsum("fi,fi->f", moved, inward)
    return np.diag(response.compliance), C


def _depth(pairs: PairForces, under: Floats, mesh: SurfaceMesh) -> Floats:
    """Return the depth of the first hand of each pair, from the thickness at its places [m]."""
    return fitting_depth(pairs, _plain(under), _MAX_FRACTION * mesh.size, PRESS_DEPTH)


def _plain(under: Floats) -> Floats:
    return np.minimum(PRESS_DEPTH, _MAX_DEPTH * under)


def placement_at(body: Body, chosen: Ints, under: float, *, felt: bool = False) -> Placement:
    """Return the placement of the hands at these vertices, with a depth for the first hand.

    Args:
        body: The body at rest.
        chosen: Vertex of each hand, shape (users,); the first hand presses.
        under: Thickness of the body under these vertices, the least of them [m].
        felt: Whether the depth is such that the first two hands feel each other: up to
            `_MAX_FRACTION` of the body's size where it is thin, and less where they press too hard.
    """
    C = body.respond([_press(body, int(k)) for k in chosen]).compliance
    x, inward = body.mesh.vertices[chosen], -body.mesh.normals[chosen]
    places = tuple(
        Place((float(p[0]), float(p[1]), float(p[2])), (float(n[0]), float(n[1]), float(n[2])))
        for p, n in zip(x, inward, strict=True)
    )
    pair, thick = expected(C[0, 0], C[0, 1], C[1, 1]), np.array(under)
    depth = float(_depth(pair, thick, body.mesh) if felt else _plain(thick))
    return Placement(
        places,
        depth,
        tuple((C[0] / np.diag(C)).tolist()),
        tuple(np.linalg.norm(x - x[0], axis=1).tolist()),
        PairForces(depth * pair.force, depth * pair.felt),
    )


# Positions of the tested tip below the surface and beside the vertex, in contact radii. A test at
# the vertex alone would accept the middle of a sharp rim, where no finger can stand.
_INSIDE, _ASIDE = 0.05, 0.1
_SQUARE = 0.9  # cosine of about 25 degrees: a finger that is this oblique still presses


def is_met_squarely(body: Body, vertices: Ints) -> npt.NDArray[np.bool_]:
    """Whether a finger that presses along a vertex's normal meets the surface squarely, (k,).

    On a rim that is narrower than a fingertip the contact slides to the neighbouring face, and a
    hand that comes from the side presses past the object.

    Args:
        body: The body at rest.
        vertices: Indices of vertices of the surface, shape (k,).
    """
    return np.array([_meets_squarely(body, k) for k in vertices.tolist()], dtype=np.bool_)


def _meets_squarely(body: Body, vertex: int) -> bool:
    x, n, radius = body.mesh.vertices[vertex], body.mesh.normals[vertex], body.contact_radius
    beside = [sign * np.array(t) for sign, t in product((-1.0, 1.0), tangents(vec3(n)))]
    for way in (np.zeros(3), *beside):
        tip = x + radius * (_ASIDE * way - _INSIDE * n)
        found = locate(body.mesh, tip, ZeroField(), radius=radius)
        if float(found.normal @ n) < _SQUARE:
            return False
    return True
