"""The search for a contact on a displaced surface: the inner loops of `world/contact.py`.

The module is compiled if a compiler is available; as plain Python it gives the same numbers. The
search writes its result to arrays of the caller, so that it creates no Python object.
"""

from __future__ import annotations

import math

import numpy as np

from cohaptic_server.mesh.search.loaded_field import LoadedField
from cohaptic_server.mesh.search.nearest_search import NearestSearch
from cohaptic_server.mesh.search.pressure_search import PressureSearch
from cohaptic_server.numeric import Floats, Ints

KEPT, MOVED, UNKNOWN = 0, 1, -1  # results of `locate`
# m; depth of a press from which on the full tolerance holds. Where facets or other users tilt the
# surface, an offset along it is also an error of the depth. For a shallower press the tolerance
# therefore shrinks with the square of depth / `_DEEP`, since both the offset and its share of the
# force matter. Without this the force on one limb was 4 % off at 2 mm.
_DEEP = 0.01
_FINEST = 1e-6  # m; no caller needs a finer tolerance
MIN_SLOPE = 0.1  # lower bound of a contact's slope; keeps the stopping distance positive
# Each iteration multiplies the offset by depth / radius of curvature; two follow a moving hand.
_MAX_ITERATIONS = 20
_MAX_RATIO = 0.5  # largest ratio of two successive offsets that Aitken extrapolation trusts
_FOOT, _POINT, _NORMAL = 0, 1, 2  # rows of a frame


class ContactSearch:
    """Searches for contacts on one surface, and holds the contact that was found last.

    Args:
        vertices: Resting positions, shape (n, 3) [m].
        normals: Normals at the vertices, shape (n, 3).
        faces: Corners of the faces, shape (m, 3).
        rings: Faces round each vertex; short rows repeat their first face, shape (n, valence).
        near: Search for the point of the resting surface nearest to a given point.
        field: Displacement field of the surface; searches use the field that is loaded.
        pressure: Pressure search, which writes vertices to `under` and shares to `weights`.
        size: Radius of a sphere of the surface's area [m].
        frame: Foot, contact point and normal that were found, shape (3, 3).
        under: Vertices under the pressure, in rising order, shape (n,).
        weights: Share of each of these vertices in the force, shape (n,).

    Attributes:
        count: Number of vertices under the pressure.
        slope: Decrease of the probe's offset beside the normal per distance that the contact moves,
            as in `Contact`.
    """

    def __init__(
        self, vertices: Floats, normals: Floats, faces: Ints, rings: Ints, near: NearestSearch,
        field: LoadedField, pressure: PressureSearch, size: float, frame: Floats, under: Ints,
        weights: Floats,
    ) -> None:  # fmt: skip
        self.vertices = vertices
        self.normals = normals
        self.faces = faces
        self.rings = rings
        self.near = near
        self.field = field
        self.pressure = pressure
        self.size = size
        self.frame = frame
        self.under = under
        self.weights = weights
        self.count = 0
        self.slope = 1.0
        self.gathered = np.zeros(rings.size, dtype=np.int64)
        self.parts = np.zeros(len(faces))

    def take(self, frame: Floats, slope: float, under: Ints, weights: Floats) -> None:
        """Copy in the contact of the last tick, from which the next search can start."""
        for i in range(3):
            for j in range(3):
                self.frame[i, j] = frame[i, j]
        self.count = under.shape[0]
        for k in range(self.count):
            self.under[k] = under[k]
            self.weights[k] = weights[k]
        self.slope = slope

    def store(self, frame: Floats, under: Ints, weights: Floats) -> None:
        """Copy the contact that was found to arrays, which may be longer than needed."""
        for i in range(3):
            for j in range(3):
                frame[i, j] = self.frame[i, j]
        for k in range(self.count):
            under[k] = self.under[k]
            weights[k] = self.weights[k]

    # One iteration with a dozen numbers that each step needs from the one before.
    def locate(
        self,
        x: float,
        y: float,
        z: float,
        radius: float,
        again: bool,
        keep: float,
        tolerance: float,
    ) -> int:
        """Find the contact of a probe on the surface that the loaded field displaces.

        Args:
            x, y, z: Position of the probe [m].
            radius: Radius of the pressure [m].
            again: Whether to start from the contact that `take` or the last search has set;
                otherwise the whole surface is searched.
            keep: Largest distance of the probe from the line along the last contact's normal at
                which this contact is kept [m].
            tolerance: Largest such distance after the contact has moved [m].

        Returns:
            `KEPT` or `MOVED`; `UNKNOWN` if the loaded field lacks a vertex under the pressure or
            beside it. The contact found so far then shows where the field is needed.
        """
        self.field.lacking = False
        state, limit = KEPT, keep
        if again:
            self.turn()
        else:
            self.slope = 1.0
            self.move_to(x, y, z)
            self.face_up()
            self.settle(radius)
            state, limit = MOVED, tolerance
        slope = self.slope
        before_x = before_y = before_z = 0.0
        factor = ratio = 0.0
        for step in range(_MAX_ITERATIONS):
            if self.field.lacking:
                return UNKNOWN
            gx, gy, gz = self.gap(0, x), self.gap(1, y), self.gap(2, z)
            nx, ny, nz = self.frame[_NORMAL, 0], self.frame[_NORMAL, 1], self.frame[_NORMAL, 2]
            height = gx * nx + gy * ny + gz * nz
            ox, oy, oz = gx - height * nx, gy - height * ny, gz - height * nz
            if step > 0:
                square = before_x * before_x + before_y * before_y + before_z * before_z
                ratio = (ox * before_x + oy * before_y + oz * before_z) / max(square, 1e-300)
                if factor > 0.0:
                    slope = min(1.0, max(MIN_SLOPE, (1.0 - ratio) / factor))
            # With a small slope the contact is further from its solution than the offset.
            fraction = min(1.0, abs(height) / _DEEP)
            near = min(limit, max(_FINEST, limit * fraction * fraction))
            if max(abs(ox), max(abs(oy), abs(oz))) < near * slope:
                break
            state, limit = MOVED, tolerance
            # Aitken extrapolation of a linearly converging step.
            factor = 1.0 / (1.0 - min(_MAX_RATIO, max(-_MAX_RATIO, ratio)))
            # Outside a round body the distance along the surface is shorter than the probe's
            # offset. Inside, steps shrink to zero at the centre, since beyond it the nearest point
            # lies on the far side: a hand that was driven through the body stays with the wall that
            # it came from.
            if height >= 0.0:
                factor /= 1.0 + height / self.size
            else:
                factor *= max(0.0, 1.0 + height / self.size)
            before_x, before_y, before_z = ox, oy, oz
            self.move_to(
                self.frame[_FOOT, 0] + factor * ox,
                self.frame[_FOOT, 1] + factor * oy,
                self.frame[_FOOT, 2] + factor * oz,
            )
            self.settle(radius)
        if self.field.lacking:
            return UNKNOWN
        self.slope = slope
        return state

    def look(self) -> int:
        """Update the normal of the contact to the loaded field; return `KEPT` or `UNKNOWN`."""
        self.field.lacking = False
        self.turn()
        return UNKNOWN if self.field.lacking else KEPT

    def put(self, place: Floats) -> None:
        """Write the contact point, displaced by the loaded field, to `place`, shape (3,) [m].

        Afterwards `field.lacking` is true if the field lacks a vertex under the pressure.
        """
        self.field.lacking = False
        for axis in range(3):
            place[axis] = -self.gap(axis, 0.0)

    def gap(self, axis: int, place: float) -> float:
        """Return a coordinate of the probe minus that of the displaced contact point [m].

        Args:
            axis: Axis of the coordinate, 0 to 2.
            place: Coordinate of the probe along this axis [m].
        """
        moved = 0.0
        for k in range(self.count):
            moved += self.weights[k] * self.field.moved(self.under[k], axis)
        return float(place - (self.frame[_POINT, axis] + moved))

    def move_to(self, x: float, y: float, z: float) -> None:
        """Move the foot to the point of the resting surface nearest to (x, y, z) [m]."""
        self.near.nearest(x, y, z)
        for axis in range(3):
            self.frame[_FOOT, axis] = self.near.foot[axis]

    def settle(self, radius: float) -> None:
        """Find the pressure, the contact point and the normal that belong to the foot."""
        self.press(radius)
        self.lift()
        self.turn()

    def press(self, radius: float) -> None:
        """Distribute a pressure round the foot over the vertices within `radius` [m].

        Vertices whose faces look away from the contact's normal get none.
        """
        x, y, z = self.frame[_FOOT, 0], self.frame[_FOOT, 1], self.frame[_FOOT, 2]
        nx, ny, nz = self.frame[_NORMAL, 0], self.frame[_NORMAL, 1], self.frame[_NORMAL, 2]
        self.count = self.pressure.spread(x, y, z, nx, ny, nz, radius)

    def face_up(self) -> None:
        """Set the normal to that of the resting face under the foot."""
        face = self.near.face
        a, b, c = self.faces[face, 0], self.faces[face, 1], self.faces[face, 2]
        ax, ay, az = self.vertices[a, 0], self.vertices[a, 1], self.vertices[a, 2]
        ux, uy, uz = self.vertices[b, 0] - ax, self.vertices[b, 1] - ay, self.vertices[b, 2] - az
        vx, vy, vz = self.vertices[c, 0] - ax, self.vertices[c, 1] - ay, self.vertices[c, 2] - az
        self.set_normal(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)

    def lift(self) -> None:
        """Set the contact point to the point of the smooth resting surface over the foot.

        Each vertex under the pressure estimates the height of the surface from its position and
        normal; taking the mean of its normal and the mean normal of all these vertices makes the
        estimate exact to second order, and therefore exact on every quadric.
        """
        x, y, z = self.frame[_FOOT, 0], self.frame[_FOOT, 1], self.frame[_FOOT, 2]
        nx = ny = nz = 0.0
        for k in range(self.count):
            vertex, weight = self.under[k], self.weights[k]
            nx += weight * self.normals[vertex, 0]
            ny += weight * self.normals[vertex, 1]
            nz += weight * self.normals[vertex, 2]
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx / length, ny / length, nz / length
        height = 0.0
        for k in range(self.count):
            vertex = self.under[k]
            height += self.weights[k] * (
                (self.vertices[vertex, 0] - x) * (self.normals[vertex, 0] + nx)
                + (self.vertices[vertex, 1] - y) * (self.normals[vertex, 1] + ny)
                + (self.vertices[vertex, 2] - z) * (self.normals[vertex, 2] + nz)
            )
        height *= 0.5
        self.frame[_POINT, 0] = x + height * nx
        self.frame[_POINT, 1] = y + height * ny
        self.frame[_POINT, 2] = z + height * nz

    def turn(self) -> None:
        """Set the normal to that of the displaced surface, averaged over the pressure."""
        nx = ny = nz = 0.0
        faces = self.gather()
        for k in range(faces):
            face = self.gathered[k]
            weight = self.parts[face]
            self.parts[face] = 0.0
            a, b, c = self.faces[face, 0], self.faces[face, 1], self.faces[face, 2]
            ax, ay, az = self.place(a, 0), self.place(a, 1), self.place(a, 2)
            ux, uy, uz = self.place(b, 0) - ax, self.place(b, 1) - ay, self.place(b, 2) - az
            vx, vy, vz = self.place(c, 0) - ax, self.place(c, 1) - ay, self.place(c, 2) - az
            nx += weight * (uy * vz - uz * vy)
            ny += weight * (uz * vx - ux * vz)
            nz += weight * (ux * vy - uy * vx)
        self.set_normal(nx, ny, nz)

    def set_normal(self, nx: float | Floats, ny: float | Floats, nz: float | Floats) -> None:
        """Set the normal of the contact to the direction of a vector."""
        length = max(1e-300, math.sqrt(nx * nx + ny * ny + nz * nz))
        self.frame[_NORMAL, 0] = nx / length
        self.frame[_NORMAL, 1] = ny / length
        self.frame[_NORMAL, 2] = nz / length

    def gather(self) -> int:
        """Find the faces with a corner under the pressure, and their weights; return how many."""
        faces = 0
        for k in range(self.count):
            vertex, weight = self.under[k], self.weights[k]
            first = self.rings[vertex, 0]
            for j in range(self.rings.shape[1]):
                face = self.rings[vertex, j]
                if j > 0 and face == first:
                    break  # short rows repeat their first face
                if self.parts[face] == 0.0:
                    self.gathered[faces] = face
                    faces += 1
                self.parts[face] += weight
        return faces

    def place(self, vertex: int, axis: int) -> float:
        """Return a coordinate of a vertex that the loaded field displaces [m]."""
        return float(self.vertices[vertex, axis] + self.field.moved(vertex, axis))
