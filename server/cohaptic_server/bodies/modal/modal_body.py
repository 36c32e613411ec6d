"""A linear body with inertia: its lowest modes swing, all else follows at once (science 3.14).

    x = C f + shapes e,    e = D f - shapes' f

The elastic body answers as if it had no mass. Each mode adds its deviation e from the amplitude
that it would have at rest, which decays as a damped oscillation, and which a change of force makes:
a force does not move a mode at once. Kinetic and elastic energy together never grow by more than
the work of the forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cohaptic.control.stability.swing import Swing
from cohaptic_server.bodies.body import Body, Load, LoadArrays, Prefetching, Response
from cohaptic_server.bodies.modal.modes import Modes, step_of, swing_of
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.numeric import Floats, Ints

# Frequencies at which the swing is looked at: from far below the slowest mode, where it is 1 % of
# its part at rest, up to that of Nyquist. A peak is as wide as its damping, 4 % at the least.
_LOWEST, _FREQUENCIES = 0.1, 300


@dataclass(frozen=True, eq=False)
class ModalResponse:
    """A response at rest, and the swing of the modes about it.

    Args:
        elastic: The response of the elastic body.
        modes: Modes of the body.
        along: Amplitude of each mode per force of each load, shape (loads, k) [sqrt(m/N)].
        static: Amplitude of each at rest under the loads, shape (k,) [sqrt(N m)].
        deviation: From it, and the speed of it over the mode's frequency, shape (k, 2) [sqrt(N m)].
        felt: Share of the swing that hands are shown, 0 to 1. Everybody sees all of it.
    """

    elastic: Response
    modes: Modes
    along: Floats
    static: Floats
    deviation: Floats
    felt: float = 0.0

    @property
    def compliance(self) -> Floats:
        """Contact compliance C, at rest, shape (c, c) [m/N]."""
        return self.elastic.compliance

    @property
    def energy(self) -> float:
        """Energy stored by the loads, elastic and kinetic [J]."""
        e, v = self.deviation.T
        return self.elastic.energy + float(self.static @ e + 0.5 * (e @ e + v @ v))

    @property
    def displacement(self) -> Floats:
        """Displacement of every vertex, shape (n, 3) [m]."""
        swing = np.tensordot(self.deviation[:, 0], self.modes.shapes, axes=1)
        return np.asarray(self.elastic.displacement + swing)

    def at(self, vertices: Ints) -> Floats:
        """Displacement of some vertices, shape (k, 3) [m]."""
        return self.elastic.at(vertices) + self._swing(vertices)

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """What a hand is shown of some vertices: without some of the loads, shape (k, 3) [m].

        Left out is what they move at rest. The swing, the own one too, is shown in part (`felt`).
        """
        left = self.elastic.without(loads, forces, vertices)
        return left + self.felt * self._swing(vertices) if self.felt else left

    def showing(self, share: float) -> ModalResponse:
        """The response as the next tick finds it, with a share of the swing that hands are shown.

        Args:
            share: 0 to 1.
        """
        return replace(self, felt=share)

    def _swing(self, vertices: Ints) -> Floats:
        shapes = self.modes.shapes[:, vertices]
        return np.asarray(np.tensordot(self.deviation[:, 0], shapes, axes=1))


class ModalBody:
    """A linear elastic body with inertia, behind the `Body` Protocol.

    Args:
        elastic: A body whose displacements under several loads add up.
        modes: Its lowest ones, on the vertices of its mesh.
        dt: Simulation period N T of the server [s].

    Attributes:
        elastic: As given.
        modes: As given.
        dt: As given.
        swing: How far the modes swing, over frequency.
        name: The elastic body's.
        mesh: The resting surface.
        contact_radius: Radius of the pressure under a contact [m].
    """

    def __init__(self, elastic: Body, modes: Modes, dt: float) -> None:
        if modes.shapes.shape[1:] != elastic.mesh.vertices.shape:
            raise ValueError(f"modes {modes.shapes.shape}, mesh {elastic.mesh.vertices.shape}")
        self.elastic, self.modes, self.dt = elastic, modes, dt
        self.name, self.mesh = elastic.name, elastic.mesh
        self.contact_radius = elastic.contact_radius
        self._step = step_of(modes.frequency, modes.damping, dt)
        at = np.geomspace(_LOWEST * float(modes.frequency.min()), np.pi / dt, _FREQUENCIES)
        sizes = swing_of(modes.frequency, modes.damping, dt, at)
        self.swing = Swing(at, np.asarray(sizes.max(axis=0)))

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> ModalResponse:
        """Swing on for a tick from the state of `before`; at rest under `loads` without one."""
        count, known = len(self.modes), before if isinstance(before, ModalResponse) else None
        elastic = self.elastic.respond(loads, None if known is None else known.elastic)
        arrays = LoadArrays.of(loads)
        along = self.along(arrays)
        static = arrays.forces @ along
        if known is None:
            return ModalResponse(elastic, self.modes, along, static, np.zeros((count, 2)))
        deviation = known.deviation.copy()
        deviation[:, 0] -= static - known.static
        deviation = np.einsum("kij,kj->ki", self._step, deviation)
        return ModalResponse(elastic, self.modes, along, static, deviation, known.felt)

    def swinging(self, response: Response) -> ModalResponse | None:
        """The response as one of this body, as in `Swings`."""
        return response if isinstance(response, ModalResponse) else None

    def along(self, loads: LoadArrays) -> Floats:
        """Amplitude of each mode per force of each load, shape (loads, k) [sqrt(m/N)]."""
        along = np.empty((len(loads.forces), len(self.modes)))
        for i, (a, b) in enumerate(zip(loads.starts.tolist(), loads.ends.tolist(), strict=True)):
            shapes = self.modes.shapes[:, loads.vertices[a:b]]
            along[i] = np.einsum("kvd,v,d->k", shapes, loads.weights[a:b], loads.directions[i])
        return along

    def prefetch(self, vertices: Ints) -> None:
        """Announce the vertices that lie ahead of sliding fingers, shape (k,)."""
        if isinstance(self.elastic, Prefetching):
            self.elastic.prefetch(vertices)

    def vertex_compliance(self) -> Floats:
        """C_ii of a contact centred at each vertex, along its normal, shape (n,) [m/N]."""
        return vertex_compliance(self.elastic)
