"""The free surface round each contact as plane, sphere or mesh, whichever the client requested.

A mesh patch contains all vertices that the probe can reach while the patch is in use. They are
vertices of the touch mesh (`touch_mesh.py`) round the contact and, for a hand that slides, along
its path over the surface for as long as the patch will be in use. If a frame of the protocol cannot
hold all of them, it holds the nearest ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cohaptic.protocol.neighbourhood import ITEM_SIZE, MAX_VERTICES, Neighbourhood
from cohaptic.protocol.patch import Geometry
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh import curvature
from cohaptic_server.mesh.touch_mesh import MAX_PATH, TouchMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.contact import Contacts
from cohaptic_server.world.loops.packing import FIELDS, largest, pack
from cohaptic_server.world.loops.rows import WindowLimits, WindowRequests, WindowRows
from cohaptic_server.world.loops.vectors import tangential_parts
from cohaptic_server.world.loops.windows import choose_windows as choose_in_one_call

# m round the contact, before the support of the client's weights is added: what `SPEEDING_UP` makes
# of 0.27 s, for shorter times too. Reasoned, not measured.
MIN_RADIUS = 0.04
# m/s by which a hand may become faster while a patch is in use. Reasoned, not measured: one that
# gets faster outruns its vertices at a long delay (docs/limits.md).
SPEEDING_UP = 0.15
_SUPPORT = 1.8  # vertex spacings; support of the client's weights (`mesh_fit.SUPPORT`)
# Margin on the radius of the disc that `MAX_VERTICES` cover, since vertices may lie further apart
# than the mean spacing. Reasoned, not measured.
_DISC_MARGIN = 1.3
_UNITS = np.array([2.0**15 - 1.0, 2.0**16 - 1.0])  # largest displacement, compliance in units
_SMALLEST = 2.0**-126  # smallest normal number in single precision (IEEE 754); smaller become 0
_UNUSABLE = Neighbourhood(math.nan, math.nan, b"")


def _half_widths(mesh: TouchMesh, horizons: Floats) -> Floats:
    """Return the distance from each contact's path within which a mesh patch needs vertices [m].

    The distance, shape (n,), covers all points that the probe can reach, or the disc that
    `MAX_VERTICES` vertices cover if that is smaller.
    """
    spacing = mesh.spacing
    widest = _DISC_MARGIN * spacing * math.sqrt(MAX_VERTICES / math.pi)
    reached = np.maximum(MIN_RADIUS, SPEEDING_UP * horizons)
    return np.minimum(reached + _SUPPORT * spacing, widest)


def quantised(
    starts: Ints, vertices: Ints, displacement: Floats, c_ii: Floats
) -> list[Neighbourhood]:
    """Encode several neighbourhoods in two compiled loops, each as by `Neighbourhood.of`.

    Args:
        starts: Where each of n neighbourhoods begins, and where the last ends, shape (n + 1,).
        vertices: Vertices of each neighbourhood, rising, at most 65,535, shape (k,).
        displacement: Displacement of each vertex, finite, shape (k, 3) [m].
        c_ii: Compliance of each vertex, finite and not negative, shape (k,) [m/N].

    Returns:
        The neighbourhoods. If a value is out of range, the scales of its neighbourhood are NaN, so
        that `encode` refuses it: only the user concerned loses a patch, and the tick goes on.

    Raises:
        ValueError: The vertices are out of order or range, or the shapes do not fit.
    """
    if displacement.shape != (len(vertices), 3) or c_ii.shape != (len(vertices),):
        raise ValueError(
            f"{len(vertices)} vertices, displacements of shape {displacement.shape} and"
            f" compliances of shape {c_ii.shape} make no neighbourhood"
        )
    limit = np.empty((len(starts) - 1, 2))
    largest(starts, displacement, c_ii, limit)
    scales = _scales(limit)
    # Values that are not finite are packed as zeros: they have no integer in Python or C.
    known = (scales > 0.0) & (scales[:, :1] >= 0.0)
    per = np.where(known, 1.0 / np.where(known, scales, 1.0), 0.0)
    numbers = np.empty((len(vertices), FIELDS), np.uint16)
    if (wrong := pack(starts, vertices, displacement, c_ii, per, numbers)) < len(per):
        own = vertices[starts[wrong] : starts[wrong + 1]]
        raise ValueError(f"vertices of a neighbourhood must rise to at most 65535: {own}")
    packed = numbers.astype("<u2", copy=False).tobytes()
    ends: list[int] = (ITEM_SIZE * starts).tolist()
    return [
        Neighbourhood(scale, c_scale, packed[a:b]) if scale >= 0.0 else _UNUSABLE
        for (scale, c_scale), a, b in zip(scales.tolist(), ends[:-1], ends[1:], strict=True)
    ]


def _scales(limit: Floats) -> Floats:
    """Return the scales of each neighbourhood as `Neighbourhood.scales` does, shape (n, 2).

    Args:
        limit: Largest displacement [m] and compliance [m/N] of each neighbourhood, shape (n, 2);
            negative values stay negative.
    """
    wanted = limit / _UNITS
    single = (wanted * (1.0 + 1e-7)).astype(np.float32).astype(np.float64)
    return np.where(np.abs(wanted) < _SMALLEST, 0.0, single)


def path_ahead(mesh: TouchMesh, speeds: Floats, horizons: Floats) -> tuple[Floats, Floats]:
    """Return the paths along which contacts will slide while their patches are in use.

    Args:
        mesh: Touch mesh of the body.
        speeds: Speed of each contact along the surface, shape (n,) [m/s].
        horizons: Time for which each patch will be in use, shape (n,) [s].

    Returns:
        Length of each path, and distance from it within which a patch needs vertices, shape (n,)
        each [m].
    """
    return np.minimum(MAX_PATH, speeds * horizons), _half_widths(mesh, horizons)


# A window reaches this far beyond the pressure, because a contact moves before the next tick: the
# sum of a length and a number of vertex spacings: 0.3 m/s at 60 ticks a second, and the vertices of
# the client's weights (`_SUPPORT`) and some more. Reasoned, not measured.
_MARGIN = 0.005  # m
_MARGIN_SPACINGS = 3.0
# m that a contact moves before its window is chosen anew, within `_MARGIN`, of which the rest is
# for the next tick. Reasoned, not measured.
_REUSE_DISTANCE = 0.002
# Ratio of a distance at rest to the same distance on the displaced surface, which may have brought
# vertices nearer. Reasoned, not measured.
_MAX_COMPRESSION = 1.3
_PLANE, _MESH = int(Geometry.PLANE), int(Geometry.MESH)
_KEY = 7  # numbers that tell whether a window still fits: foot, slide, horizon
_USUAL = 96  # vertices of a window for which arrays have room at first; they grow where needed


class Windows(NamedTuple):
    """Vertices round the contacts of n users at which a tick evaluates the free surface.

    Args:
        geometry: Geometry of the patches, as on the wire, shape (n,).
        keys: Values for which each window was chosen: foot of the contact on the resting surface
            [m], slide of the probe while the patch is in use [m], and time for which the patch is
            in use [s]; shape (n, 7).
        starts: Where each window begins, and where the last ends, in `vertices`, in `fitted`, and
            in `touched` and `carried`; shape (3, n + 1).
        vertices: Vertices of the surface, those of each window ascending, shape (k,) or longer.
        fitted: Vertices from which the curvature is fitted, as positions in the window: vertices
            that are also in the touch mesh and face the same way as the contact; none for a plane.
        touched: Vertices of the touch mesh that a mesh patch contains, ascending; none for other
            geometries.
        carried: Positions of the `touched` vertices in `vertices`.
    """

    geometry: Ints
    keys: Floats
    starts: Ints
    vertices: Ints
    fitted: Ints
    touched: Ints
    carried: Ints

    @classmethod
    def room_for(cls, geometry: Ints, vertices: int) -> Windows:
        """Return empty windows whose arrays have room for `vertices` vertices in all."""
        n = len(geometry)
        starts, flat = np.zeros((3, n + 1), dtype=np.int64), np.empty((4, vertices), dtype=np.int64)
        return cls(geometry, np.empty((n, _KEY)), starts, *flat)

    def widened(self) -> Windows:
        """Return a copy of the windows whose arrays have twice the room."""
        flat = (np.concatenate([part, np.empty_like(part)]) for part in self[3:])
        return Windows(self.geometry, self.keys, self.starts, *flat)


NO_WINDOWS = Windows.room_for(np.zeros(0, dtype=np.int64), 0)


def choose_windows(
    touched_body: TouchedBody,
    geometries: Sequence[Geometry],
    contacts: Contacts,
    velocities: Floats,
    horizons: Floats,
    before: Ints,
    previous: Windows,
) -> Windows:
    """Choose the vertices round each contact; reuse a window of the last tick if it still suffices.

    Args:
        touched_body: The deformable object and its touch mesh.
        geometries: Geometries of the patches.
        contacts: Contacts of the probes.
        velocities: Velocities of the probes, shape (n, 3) [m/s].
        horizons: Time for which each patch will be in use, shape (n,) [s].
        before: Row of each user in `previous`; -1 for a user without a window there, shape (n,).
        previous: Windows of the last tick.
    """
    body = touched_body.body
    mesh, tangential = body.mesh, np.empty_like(velocities)
    geometry = np.array(geometries, dtype=np.int64)
    tangential_parts(contacts.frames, velocities, tangential)
    radius = body.contact_radius + _MARGIN + _MARGIN_SPACINGS * mesh.spacing()
    reach = _MAX_COMPRESSION * curvature.fit_radius(mesh, body.contact_radius)
    if not (geometry != _PLANE).any():
        # A room of planes needs no touch mesh, which may take long to make.
        finder, spacing = None, 0.0
        lengths = half_widths = np.zeros(len(geometry))
    else:
        finder = touched_body.windows.search
        spacing = touched_body.mesh.spacing
        speeds = np.sqrt((tangential * tangential).sum(axis=1))
        lengths, half_widths = path_ahead(touched_body.mesh, speeds, horizons)
    # A quarter more room than in the last tick: a hand that slides faster needs a larger window.
    room = max(_USUAL * len(geometry), 5 * int(previous.starts[0, -1]) // 4)
    chosen = Windows.room_for(geometry, room)
    user, slides = 0, tangential * horizons[:, None]
    asked = WindowRequests(
        geometry, contacts.frames, slides, tangential, horizons, lengths, half_widths
    )
    limits = WindowLimits(radius, reach, spacing, MAX_VERTICES, _REUSE_DISTANCE, SPEEDING_UP)
    tree, old = mesh.near_tree, WindowRows(*previous)
    while True:
        user = choose_in_one_call(
            tree.tree, tree.found, finder, user, asked, limits, before, old, WindowRows(*chosen)
        )
        if user == len(geometry):
            return chosen
        chosen = chosen.widened()


def free_shapes(
    touched_body: TouchedBody,
    windows: Windows,
    displacement: Floats,
    x_free: Floats,
    normals: Floats,
) -> tuple[Floats, list[Neighbourhood | None]]:
    """Return curvature [1/m] and mesh neighbourhood of the free surface round each contact.

    A plane has curvature 0 and no neighbourhood. A mesh patch has both: a probe beyond the end of
    the neighbourhood needs the curvature.

    Args:
        touched_body: The deformable object and its touch mesh.
        windows: Windows of the contacts, with the geometries of the patches.
        displacement: Displacement of the free surface at the windows' vertices, shape (k, 3) [m].
        x_free: Contact points on the free surfaces, shape (n, 3) [m].
        normals: Outward unit normals there, shape (n, 3).
    """
    body, n = touched_body.body, len(x_free)
    starts = windows.starts
    if starts[1, n] == 0:
        return np.zeros(n), [None] * n
    radius = curvature.fit_radius(body.mesh, body.contact_radius)
    curvatures = curvature.fit_curvatures(
        body.mesh.vertices, starts, windows.vertices, displacement, windows.fitted, x_free, normals,
        radius,
    )  # fmt: skip
    carries = starts[2]
    if carries[n] == 0:
        return curvatures, [None] * n
    touched = windows.touched[: carries[n]]
    made = quantised(
        carries,
        touched,
        displacement[windows.carried[: carries[n]]],
        touched_body.touch_compliance[touched],
    )
    kinds = windows.geometry.tolist()
    return curvatures, [
        one if kind == _MESH else None for one, kind in zip(made, kinds, strict=True)
    ]
