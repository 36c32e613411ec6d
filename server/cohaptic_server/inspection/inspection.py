"""What an object from a file is like: numbers and sentences, for `cohaptic body inspect`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cohaptic.clock import Clock
from cohaptic.errors import SettingError
from cohaptic_server.bodies.solid.shape import SolidShape
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.inspection.natural_frequency import lowest_frequency
from cohaptic_server.inspection.tet_quality import Quality, quality
from cohaptic_server.inspection.tick_cost import USERS, TickCost, tick_cost
from cohaptic_server.mesh.sampling import spread_over
from cohaptic_server.mesh.thickness import is_smooth, thickness
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.build import Built
from cohaptic_server.objects.object_file import ObjectFile, Prepared
from cohaptic_server.objects.tetrahedralise import ENVELOPE

HONEST = 0.2  # of the lowest natural frequency: what changes that fast is 4 % off without mass
_RIGID = 1e-9  # m/N; a place softer than this is not held
_LOOKED_AT = 600  # places for the thickness
_THIN = 2.0  # contact radii; a thinner part bends under a finger rather than being dented


@dataclass(frozen=True, eq=False)
class Inspection:
    """What was found.

    Args:
        solid: The object.
        prepared: What came of its file.
        quality: Of its tetrahedra.
        density: [kg/m^3].
        frequency: Lowest natural one, as it is held [Hz].
        stiffness: K_o at each vertex of the surface, infinite where it is held, (n,) [N/m].
        thinnest: Thickness at the thinnest place looked at [m].
        cost: Of a tick.
    """

    solid: Solid
    prepared: Prepared
    quality: Quality
    density: float
    frequency: float
    stiffness: Floats
    thinnest: float
    cost: TickCost

    @property
    def mass(self) -> float:
        """[kg]."""
        return self.density * self.solid.shape.tets.volume

    def lines(self, wanted: ObjectFile) -> list[tuple[str, str]]:
        """A heading and a sentence for each thing worth knowing."""
        shape, q, solid = self.solid.shape, self.quality, self.solid
        free = self.stiffness[np.isfinite(self.stiffness)]
        low, middle, high = np.percentile(free, [0.0, 50.0, 100.0])
        softest = 1e3 * shape.mesh.vertices[int(self.stiffness.argmin())]
        size = 1e3 * np.ptp(shape.mesh.vertices, axis=0)
        kept = solid.columns.store.capacity * solid.columns.store.column_bytes
        one, many = (1e3 * t for t in self.cost.ticks)
        poor = f", {q.poor} below 0.01" if q.poor else ""
        return [
            ("file", "; ".join(what_came(wanted, self.prepared))),
            ("size", f"{size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} mm"),
            (
                "mesh",
                f"{len(shape.tets.tets):,} tetrahedra of order {wanted.material.order},"
                f" {len(shape.nodes):,} nodes, {len(shape.mesh.vertices):,} on the surface",
            ),
            (
                "quality",
                f"angles between faces {q.sharpest:.1f} to {q.bluntest:.1f} degrees; volume over"
                f" that of a regular one {q.fullest:.2f} in the median, {q.flattest:.3f} at"
                f" worst{poor}",
            ),
            ("held", _held(shape)),
            ("volume", f"{1e6 * shape.tets.volume:.4g} cm3, {self.mass:.3g} kg"),
            (
                "frequency",
                f"the lowest natural one is {self.frequency:.3g} Hz: hands slower than about"
                f" {HONEST * self.frequency:.2g} Hz feel the body as it is, faster ones would feel"
                " its mass",
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
                f"factor {_bytes(solid.factor_bytes)}, columns up to {_bytes(kept)}",
            ),
            (
                "tick",
                f"about {one:.2g} ms for {USERS[0]} user, {many:.2g} ms for {USERS[1]}, on this"
                f" machine now; columns of a new place come within {1e3 * self.cost.first:.2g} ms",
            ),
        ]

    def _thin(self) -> str:
        radius = self.solid.contact_radius
        words = f"about {1e3 * self.thinnest:.2g} mm"
        if self.thinnest < _THIN * radius:
            words += (
                f": below {_THIN:g} contact radii a press bends the part rather than dents it;"
                " see that it has two tetrahedra through its thickness (--edge)"
            )
        return words


def inspect(
    wanted: ObjectFile,
    built: Built,
    clock: Clock,
    density: float,
    progress: Callable[[str, float], None] = lambda phase, share: None,
) -> Inspection:
    """Look at an object; its solid then works in the background.

    Args:
        wanted: The file and its options.
        built: What came of it.
        clock: For the cost of a tick.
        density: [kg/m^3].
        progress: Is told the phase and the share of it that is done.
    """
    if not 1.0 <= density <= 30000.0:
        raise SettingError("--density", f"{density:g} kg/m3", "from 1 to 30000 kg/m3")
    solid = built.solid
    shape, mesh = solid.shape, solid.mesh
    compliance = solid.vertex_compliance()
    held = shape.fixed[shape.surface] | (compliance < _RIGID)
    stiffness = np.where(held, np.inf, 1.0 / np.where(held, 1.0, compliance))
    progress("lowest natural frequency", 0.0)
    frequency = lowest_frequency(
        shape, wanted.material, density, lambda share: progress("lowest natural frequency", share)
    )
    progress("cost of a tick", 0.0)
    # At an edge or a tip it is not thin, it ends.
    smooth = np.flatnonzero(is_smooth(mesh))
    looked = smooth[spread_over(mesh.vertices[smooth], _LOOKED_AT)]
    return Inspection(
        solid,
        built.prepared,
        quality(shape.tets),
        density,
        frequency,
        stiffness,
        float(thickness(mesh, looked).min(initial=2.0 * mesh.size)),
        tick_cost(solid, clock),
    )


def what_came(wanted: ObjectFile, prepared: Prepared) -> list[str]:
    """What was found in a file, and what was done about it."""
    if prepared.surface is None:
        return ["a volume mesh, taken as it is"]
    found = [f"a surface of {prepared.triangles:,} triangles"]
    if prepared.simplified:
        found.append(f"simplified to {prepared.simplified:,} at your word")
    problems = prepared.surface.problems()
    if prepared.surface.pieces > 1:
        problems.append(f"it was in {prepared.surface.pieces} pieces")
    if problems:
        found += [*problems, "closed and untangled as fTetWild saw fit (--repair)"]
    else:
        found.append("closed, free of crossings, in one piece: nothing was repaired")
    if prepared.surface.volume < 0.0:
        found.append("turned outside out")
    was = abs(prepared.surface.volume) * wanted.scale**3
    change = prepared.tets.volume / was - 1.0
    diagonal = float(np.linalg.norm(np.ptp(prepared.tets.vertices, axis=0)))
    found.append(
        f"its tetrahedra follow it within {1e3 * ENVELOPE * diagonal:.2g} mm and its volume"
        f" to {change:+.1%}"
    )
    return found


def _held(shape: SolidShape) -> str:
    held = shape.fixed[shape.surface]
    share = float(held.mean())
    return f"{int(shape.fixed.sum()):,} nodes, {share:.0%} of the vertices of the surface"


def _bytes(count: float) -> str:
    return f"{count / 1e9:.2g} GB" if count >= 1e9 else f"{count / 1e6:.3g} MB"
