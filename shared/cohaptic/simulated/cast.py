"""Find the place where a simulated hand that comes from one side meets a body of any shape.

The module casts a horizontal ray at the body at the height of its centre and, if that ray misses,
further rays above and below. Loops in Python over the triangles are quick enough, since this
happens once, before a hand begins.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.simulated.hand import Place
from cohaptic.vec import Vec3, add, cross, dot, norm, scale, sub, unit

_HEIGHTS = 9  # rays above the centre, and as many below
_FACING = 0.3  # least cosine between a ray and the normal; at a lower one a finger would glance off
_ROUND = 0.02  # fraction of the radius by which a facet may lie below the sphere round a body


def cast(mesh: RestMesh, center: Vec3, radius: float, contact_radius: float, angle: float) -> Place:
    """Find the point of a resting surface that a hand at `angle` meets first.

    Args:
        mesh: Resting surface.
        center: Centre of a sphere that encloses the mesh [m].
        radius: Radius of that sphere [m].
        contact_radius: Contact radius of a fingertip, over which the function averages the
            surface's normal [m].
        angle: Direction of the hand seen from above, 0 to the right of the body, counter-clockwise
            [rad].

    Returns:
        The point hit and the direction into the body. If the body fills the sphere there, this is
        the point of the sphere itself; if all rays miss, it is the vertex that lies furthest out.
    """
    out: Vec3 = (math.cos(angle), math.sin(angle), 0.0)
    seen = [sub(v, center) for v in mesh.vertices]
    point = _first_hit(seen, mesh.faces, out, radius)
    if point is None:
        point = max(seen, key=lambda v: dot(v, out))
    normal = _normal(seen, mesh.faces, point, contact_radius, out)
    on_sphere = scale(out, radius)
    if norm(sub(point, on_sphere)) <= _ROUND * radius and dot(normal, out) > 1.0 - _ROUND:
        point, normal = on_sphere, out
    return Place(add(center, point), scale(normal, -1.0))


def _first_hit(
    seen: Sequence[Vec3], faces: Sequence[tuple[int, int, int]], out: Vec3, radius: float
) -> Vec3 | None:
    """Return the outermost hit of the first ray that does not glance off the mesh; None if none.

    The rays are horizontal and opposite to `out`, the one nearest to the centre first.
    """
    flat = [(-out[1] * x + out[0] * y, z, out[0] * x + out[1] * y) for x, y, z in seen]
    crossed = [
        face
        for face in faces
        if min(flat[k][0] for k in face) <= 0.0 <= max(flat[k][0] for k in face)
    ]
    for k in range(_HEIGHTS + 1):
        for height in {k * radius / (_HEIGHTS + 1), -k * radius / (_HEIGHTS + 1)}:
            hits = list(_hits(seen, flat, crossed, height))
            if hits:
                far, facing = max(hits)
                if facing >= _FACING:
                    return add(scale(out, far), (0.0, 0.0, height))
    return None


def _hits(
    seen: Sequence[Vec3],
    flat: Sequence[Vec3],
    faces: Sequence[tuple[int, int, int]],
    height: float,
) -> Iterator[tuple[float, float]]:
    """Yield the hits of a horizontal ray on triangles that face the viewer.

    A hit is a position along the ray [m] and the cosine between the ray and the triangle's normal.

    Args:
        seen: Vertices relative to the centre [m].
        flat: The same vertices in the frame of a viewer on the ray, with the axes sideways, up, and
            towards the viewer [m].
        faces: Faces that the ray may meet.
        height: Height of the ray [m].
    """
    for a, b, c in faces:
        (ax, ay, af), (bx, by, bf), (cx, cy, cf) = flat[a], flat[b], flat[c]
        ay, by, cy = ay - height, by - height, cy - height
        # Seen from outside along the ray, a triangle that faces outwards is counter-clockwise.
        wa, wb, wc = bx * cy - cx * by, cx * ay - ax * cy, ax * by - bx * ay
        area = wa + wb + wc
        if area > 0.0 and min(wa, wb, wc) >= 0.0:
            across = norm(cross(sub(seen[b], seen[a]), sub(seen[c], seen[a])))
            yield (wa * af + wb * bf + wc * cf) / area, area / across


def _normal(
    seen: Sequence[Vec3], faces: Sequence[tuple[int, int, int]], at: Vec3, reach: float, out: Vec3
) -> Vec3:
    """Return the mean outward unit normal of the faces that lie near `at` and face towards `out`.

    Args:
        seen: Vertices relative to the centre [m].
        reach: Distance from `at` within which a face is near [m].
    """
    total: Vec3 = (0.0, 0.0, 0.0)
    for a, b, c in faces:
        corners = seen[a], seen[b], seen[c]
        vector = cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]))
        middle = scale(add(add(*corners[:2]), corners[2]), 1.0 / 3.0)
        near = min(norm(sub(place, at)) for place in (*corners, middle))
        if near <= reach and dot(vector, out) > 0.0:
            total = add(total, vector)
    return unit(total, out)
