"""Determines the properties of an object, as numbers and sentences, for `cohaptic body inspect`.

The properties include the quality of the tetrahedra, and the duration of a tick, measured on this
machine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from cohaptic.clock import Clock
from cohaptic.control.law import DEFAULT_LAW
from cohaptic.vec import ZERO, Vec3
from cohaptic_server.bodies.modal.modal_body import HIGHEST
from cohaptic_server.bodies.solid.shape import SolidShape
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.solid.vibration import lowest_frequency
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh.surface import spread_over
from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh, gradients, volumes
from cohaptic_server.mesh.thin_parts import is_smooth, thickness
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.build import Built
from cohaptic_server.objects.cost import FRACTION_OF_PERIOD, Demand
from cohaptic_server.objects.inertia.inertia import WATER
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.parts import Parts
from cohaptic_server.objects.prepare import Prepared
from cohaptic_server.world.state import Participant, Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState

USERS = (1, 8)
_TICKS = 31
_PERIOD = 1.0 / 60.0  # s


@dataclass(frozen=True, slots=True)
class TickCost:
    """Measured times of the ticks of one solid on one machine.

    Args:
        ticks: Median duration of a tick for each number in `users`, with all columns known [s].
        column_latency: Time until the compliance columns of a new contact are known [s].
        users: Numbers of users for which `ticks` was measured.
    """

    ticks: tuple[float, ...]
    column_latency: float
    users: tuple[int, ...] = USERS


def tick_cost(solid: Solid, clock: Clock, users: tuple[int, ...] = USERS) -> TickCost:
    """Measure the duration of ticks with contacts spread over the surface.

    After this call the solid uses its far field while columns are missing.
    """
    mesh = solid.mesh
    free = np.flatnonzero(~solid.shape.fixed[solid.shape.surface])
    vertices = free[spread_over(mesh.vertices[free], max(users))]
    solid.in_background()
    with threadpool_limits(limits=1):  # as on the server
        start = clock.now()
        _ticks(solid, vertices[:1], clock, 1)
        solid.solve_missing(64)
        latency = clock.now() - start
        medians = tuple(
            float(np.median(_ticks(solid, vertices[:count], clock, _TICKS))) for count in users
        )
    return TickCost(medians, latency, users)


def _ticks(
    solid: Solid, vertices: np.ndarray[tuple[int], np.dtype[np.int64]], clock: Clock, n: int
) -> list[float]:
    x, out = solid.mesh.vertices[vertices], solid.mesh.normals[vertices]
    state, times = WorldState(), list[float]()
    for tick in range(n):
        touches = [
            Touch(
                who=Participant(
                    user=user + 1, law=DEFAULT_LAW, max_stiffness=1000.0, max_force=10.0
                ),
                probe=_vec(x[user] - 0.001 * out[user]),
                force=_vec(0.5 * out[user]),
                seq=tick + 1,
                tick=tick,
                t_client=tick * _PERIOD,
                arrived=tick * _PERIOD,
            )
            for user in range(len(vertices))
        ]
        start = clock.now()
        state, _ = advance(TouchedBody(solid), state, touches, now=tick * _PERIOD, dt=_PERIOD)
        times.append(clock.now() - start)
        # On a server, another process solves for the missing columns.
        while len(solid.missing) and not solid.pending:
            solid.solve_missing(64)
    return times


def _vec(a: Floats) -> Vec3:
    return (float(a[0]), float(a[1]), float(a[2]))


@dataclass(frozen=True, slots=True)
class Quality:
    """Dihedral angles and volume ratios of a mesh of tetrahedra.

    A volume ratio is the volume of a tetrahedron over the volume of a regular tetrahedron with the
    same longest edge: 1 for a regular tetrahedron, 0 for a flat one.

    Args:
        min_dihedral: Smallest dihedral angle [degrees]; 70.5 in a regular tetrahedron.
        max_dihedral: Largest dihedral angle [degrees].
        median_ratio: Median volume ratio.
        min_ratio: Least volume ratio.
        slivers: Number of tetrahedra whose volume ratio is below 0.01.
    """

    min_dihedral: float
    max_dihedral: float
    median_ratio: float
    min_ratio: float
    slivers: int


def quality(tets: TetMesh) -> Quality:
    """Return the dihedral angles and volume ratios of a mesh of tetrahedra."""
    g = gradients(tets.vertices, tets.tets)
    n = g / np.linalg.norm(g, axis=2, keepdims=True)
    # The gradient of a corner's shape function points inwards, normal to the opposite face.
    cosines = [-np.einsum("mi,mi->m", n[:, a], n[:, b]) for a, b in EDGES]
    angles = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    x = tets.vertices
    edges = np.stack([x[tets.tets[:, a]] - x[tets.tets[:, b]] for a, b in EDGES], axis=1)
    longest = np.sqrt(np.einsum("mei,mei->me", edges, edges).max(axis=1))
    ratio = volumes(x, tets.tets) * 6.0 * 2.0**0.5 / longest**3
    return Quality(
        float(angles.min()),
        float(angles.max()),
        float(np.median(ratio)),
        float(ratio.min()),
        int((ratio < 0.01).sum()),
    )


# Fraction of the lowest natural frequency below which a model without mass errs by less than 4 %.
QUASI_STATIC = 0.2
_THICKNESS_SAMPLES = 600  # vertices at which the thickness is measured
_THIN = 2.0  # contact radii; a thinner part bends as a whole under a finger, without a dent


@dataclass(frozen=True, eq=False)
class Inspection:
    """Properties of an object from a file.

    Args:
        solid: The object as a solid that can be touched.
        prepared: Tetrahedra of the object, and the report on the surface in the file.
        quality: Quality of the tetrahedra.
        density: Mass density of each of the m tetrahedra, shape (m,) [kg/m^3].
        frequency: Lowest natural frequency [Hz].
        stiffness: Stiffness K_o at each of the n surface vertices, infinite at fixed ones, shape
            (n,) [N/m].
        thinnest: Least thickness over the vertices at which it was measured [m].
        cost: Measured durations of a tick.
        parts: Parts of the tetrahedra; None if there are none.
        hz: Ticks per second for which the cost is judged.
    """

    solid: Solid
    prepared: Prepared
    quality: Quality
    density: Floats
    frequency: float
    stiffness: Floats
    thinnest: float
    cost: TickCost
    parts: Parts | None
    hz: float = 60.0

    @property
    def mass(self) -> float:
        """Mass of the object [kg]."""
        tets = self.solid.shape.tets
        return float(self.density @ volumes(tets.vertices, tets.tets))

    def lines(self, source: ObjectFile) -> list[tuple[str, str]]:
        """Return a heading and a sentence for each property."""
        shape, q, solid = self.solid.shape, self.quality, self.solid
        free = self.stiffness[np.isfinite(self.stiffness)]
        low, middle, high = np.percentile(free, [0.0, 50.0, 100.0])
        origin = np.array(shape.mesh.origin)
        softest = 1e3 * (origin + shape.mesh.vertices[int(self.stiffness.argmin())])
        size = 1e3 * np.ptp(shape.mesh.vertices, axis=0)
        column_bytes = solid.columns.store.capacity * solid.columns.store.column_bytes
        one, many = (1e3 * t for t in self.cost.ticks)
        few, all_users = self.cost.users
        slivers = f", {q.slivers} below 0.01" if q.slivers else ""
        return [
            ("file", "; ".join(describe_file(source, self.prepared))),
            ("size", f"{size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} mm"),
            *_place(shape.mesh.origin),
            (
                "mesh",
                f"{len(shape.tets.tets):,} tetrahedra of order {source.material.order},"
                f" {len(shape.nodes):,} nodes, {len(shape.mesh.vertices):,} on the surface",
            ),
            (
                "quality",
                f"angles between faces {q.min_dihedral:.1f} to {q.max_dihedral:.1f} degrees; volume"
                f" over that of a regular one {q.median_ratio:.2f} in the median,"
                f" {q.min_ratio:.3f} at worst{slivers}",
            ),
            ("held", _held(shape)),
            ("volume", f"{1e6 * shape.tets.volume:.4g} cm3, {self.mass:.3g} kg"),
            *self._parts(source),
            (
                "frequency",
                f"the lowest natural one is {self.frequency:.3g} Hz: hands slower than about"
                f" {QUASI_STATIC * self.frequency:.2g} Hz feel the body as it is, faster ones would"
                f" feel its mass{self._sways(source)}",
            ),
            (
                "stiffness",
                f"K_o {low:.3g} to {high:.3g} N/m, {middle:.3g} in the median, under a contact of"
                f" {1e3 * shape.contact_radius:.1f} mm; softest at"
                f" ({softest[0]:.0f}, {softest[1]:.0f}, {softest[2]:.0f}) mm",
            ),
            ("thinnest", self._thin()),
            (
                "memory",
                f"factor {_bytes(solid.factor_bytes)}, columns up to {_bytes(column_bytes)}",
            ),
            (
                "tick",
                f"about {one:.2g} ms for {few} user, {many:.2g} ms for {all_users}, on this"
                " machine now; columns of a new place come within"
                f" {1e3 * self.cost.column_latency:.2g} ms{self._slow()}",
            ),
        ]

    def _parts(self, source: ObjectFile) -> list[tuple[str, str]]:
        """Return a heading and a sentence for each part: its name, material and volume."""
        if self.parts is None:
            return []
        sizes = self.parts.volumes(self.solid.shape.tets)
        lines = zip(part_words(source, self.parts), sizes.tolist(), strict=True)
        return [("part", f"{words}, {1e6 * size:.4g} cm3") for words, size in lines]

    def _sways(self, source: ObjectFile) -> str:
        """Return a remark if a real body would swing at this lowest frequency; empty if not."""
        if self.frequency >= HIGHEST:
            return ""
        if source.inertia.given:
            return f". Served with its density, it swings in its modes below {HIGHEST:g} Hz"
        return (
            f". A real one would sway: let it, with --density {WATER:g}; or hold more of it"
            " (--fix), or take a stiffer one (--young)"
        )

    def _slow(self) -> str:
        """Return advice if ticks take too long for the users; empty if they do not."""
        allowed = FRACTION_OF_PERIOD / self.hz
        if self.cost.ticks[1] < allowed:
            return ""
        return (
            f". {self.cost.users[1]} users at {self.hz:g} Hz need ticks below"
            f" {1e3 * allowed:.2g} ms: take a coarser mesh (--edge), fewer users or a lower"
            " --simulation-hz"
        )

    def _thin(self) -> str:
        radius = self.solid.contact_radius
        words = f"about {1e3 * self.thinnest:.2g} mm"
        if self.thinnest < _THIN * radius:
            words += (
                f": below {_THIN:g} contact radii a press bends the part rather than dents it;"
                " see that it has two tetrahedra through its thickness (--edge)"
            )
        return words


def inspect_object(
    source: ObjectFile,
    built: Built,
    clock: Clock,
    progress: Callable[[str, float], None] = lambda phase, fraction: None,
    demand: Demand | None = None,
) -> Inspection:
    """Measure the properties of an object.

    After this call the object's solid uses its far field while columns are missing.

    Args:
        source: File of the object, and its options.
        built: Solid that was built from the file.
        clock: Clock that measures the ticks.
        progress: Called with the name of each phase and the finished fraction of it, 0 to 1.
        demand: Users and tick rate for which the duration of a tick is judged; None for 8 users at
            60 Hz.

    Raises:
        SettingError: A density names no part.
    """
    solid = built.solid
    each = source.inertia.of_elements(built.parts, len(solid.shape.tets.tets))
    shape, mesh = solid.shape, solid.mesh
    compliance = solid.vertex_compliance()
    # A vertex also counts as fixed if a contact there covers only fixed vertices.
    fixed = shape.fixed[shape.surface] | (compliance == 0.0)
    stiffness = np.where(fixed, np.inf, 1.0 / np.where(fixed, 1.0, compliance))
    progress("lowest natural frequency", 0.0)
    frequency = lowest_frequency(
        shape, each, lambda fraction: progress("lowest natural frequency", fraction)
    )
    progress("cost of a tick", 0.0)
    # At an edge or a tip the distance to the opposite side does not measure the thickness.
    smooth = np.flatnonzero(is_smooth(mesh))
    sampled = smooth[spread_over(mesh.vertices[smooth], _THICKNESS_SAMPLES)]
    return Inspection(
        solid,
        built.prepared,
        quality(shape.tets),
        each,
        frequency,
        stiffness,
        float(thickness(mesh, sampled).min(initial=2.0 * mesh.size)),
        tick_cost(solid, clock, USERS if demand is None else (1, demand.users)),
        built.parts,
        60.0 if demand is None else demand.hz,
    )


def part_words(source: ObjectFile, parts: Parts) -> list[str]:
    """Return the name and material of each part, in words."""
    return [
        f"{name}: E {young:g} Pa, \N{GREEK SMALL LETTER NU} {nu:g}"
        for name in parts.names
        for young, nu in [source.parts.of_part(source.material, name)]
    ]


def describe_file(source: ObjectFile, prepared: Prepared) -> list[str]:
    """Return phrases on the surface in a file, its defects and their repair."""
    if prepared.surface is None:
        return [f"a volume mesh, taken as it is{_in_parts(prepared)}"]
    phrases = ["a label map", *prepared.words] if prepared.words else []
    phrases += [f"a surface of {prepared.triangles:,} triangles{_in_parts(prepared)}"]
    if prepared.simplified:
        why = "" if prepared.words else " at your word"
        phrases.append(f"simplified to {prepared.simplified:,}{why}")
    problems = prepared.surface.problems()
    if prepared.surface.components > 1:
        problems.append(f"it was in {prepared.surface.components} pieces")
    if problems:
        phrases += [*problems, "closed and untangled as fTetWild saw fit (--repair)"]
    else:
        each = "each " if prepared.parts else ""
        phrases.append(f"{each}closed, free of crossings, in one piece: nothing was repaired")
    if prepared.surface.volume < 0.0:
        phrases.append("turned outside out")
    follows = f"its tetrahedra follow it within {1e3 * prepared.deviation:.2g} mm"
    if prepared.parts is None or prepared.words:  # the parts of a surface may overlap
        enclosed = abs(prepared.surface.volume) * source.scale**3
        follows += f" and its volume to {prepared.tets.volume / enclosed - 1.0:+.1%}"
    return [*phrases, follows]


def _in_parts(prepared: Prepared) -> str:
    count = len(prepared.parts.names) if prepared.parts else 0
    return f" in {count} parts" if count > 1 else ""


def _place(origin: Vec3) -> list[tuple[str, str]]:
    """Return a heading and a sentence if the object is not served about its file's origin."""
    if origin == ZERO:
        return []
    x, y, z = (f"{1e3 * value:.10g}" for value in origin)
    sentence = f"served about the point ({x}, {y}, {z}) mm of its file, times --scale"
    return [("origin", sentence)]


def _held(shape: SolidShape) -> str:
    fraction = float(shape.fixed[shape.surface].mean())
    return f"{int(shape.fixed.sum()):,} nodes, {fraction:.0%} of the vertices of the surface"


def _bytes(count: float) -> str:
    return f"{count / 1e9:.2g} GB" if count >= 1e9 else f"{count / 1e6:.3g} MB"
