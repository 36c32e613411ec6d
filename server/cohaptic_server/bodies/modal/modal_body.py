"""A linear body with inertia: its lowest modes swing, all others follow at once (science 3.14).

    x = C f + shapes e,    e = (D - 1) shapes' f

The displacement x of the surface is the static displacement by the forces f, with the compliance C
of an elastic body without mass, plus the deviations e of the lowest natural modes. `shapes` are
these modes as displacements of the surface, shapes' f are their static amplitudes, and D is the
second-order low-pass of each mode. A change of force creates a deviation, because a mode does not
follow a force at once; the deviation then decays as a damped oscillation. Kinetic and elastic
energy together never grow by more than the work of the forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cohaptic.control.stability.swing import Swing
from cohaptic.errors import SettingError
from cohaptic_server.bodies.body import Body, Load, LoadArrays, Prefetching, Response
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.touchable import DAMPING_RATIO

# Highest frequency of a mode. Above it even the unsteadiest hand excites no mode, and ticks at
# 60 Hz have at most six samples per period: to a hand the body is at rest at once.
HIGHEST = 10.0  # Hz
LARGEST = 6  # modes; each adds a displacement field that every tick evaluates


@dataclass(frozen=True, eq=False)
class Modes:
    """The k natural modes of a body on the n vertices of its surface.

    Args:
        frequency: Natural angular frequencies without damping, shape (k,) [rad/s].
        shapes: Displacement of the surface by each mode, shape (k, n, 3) [sqrt(m/N)]. A force f on
            a vertex gives a mode the static amplitude g = shapes . f [sqrt(N m)], which moves the
            surface by shapes g [m] and has the energy g^2 / 2 [J]. So shapes' shapes is the mode's
            part of the compliance.
        damping: Damping ratio of every mode, as a share of critical damping.

    Raises:
        SettingError: The damping is out of range.
    """

    frequency: Floats
    shapes: Floats
    damping: float = DAMPING_RATIO

    def __post_init__(self) -> None:
        check_damping_ratio(self.damping)
        if self.shapes.shape[:1] != self.frequency.shape or not (self.frequency > 0.0).all():
            raise ValueError(f"shapes {self.shapes.shape} of frequencies {self.frequency}")

    def __len__(self) -> int:
        return len(self.frequency)


def check_damping_ratio(damping: float) -> None:
    """Raise an error for a damping ratio outside of the range of the oscillator model.

    Raises:
        SettingError: The ratio is below 0.02, where a swing outlasts a visit, or above 0.95, where
            a mode does not swing and `--relaxation` describes it better.
    """
    if not 0.02 <= damping <= 0.95:
        raise SettingError("--damping-ratio", damping, "from 0.02 to 0.95 of critical damping")


def step_of(frequency: Floats, damping: float, dt: float) -> Floats:
    """Return the matrix that advances each mode's deviation e by one tick.

    The matrix gives the exact free motion of e'' + 2 zeta w e' + w^2 e = 0 in the coordinates
    (e, e' / w).

    Args:
        frequency: Angular frequency w of each mode, shape (k,) [rad/s].
        damping: Damping ratio zeta, below 1.
        dt: Simulation period N T [s].

    Returns:
        Matrices of all modes, shape (k, 2, 2).
    """
    root = np.sqrt(1.0 - damping * damping)
    angle = frequency * (root * dt)
    decay = np.exp(-damping * frequency * dt)
    cos, sin = decay * np.cos(angle), decay * np.sin(angle) / root
    return np.array([[cos + damping * sin, sin], [-sin, cos - damping * sin]]).transpose(2, 0, 1)


def swing_of(frequency: Floats, damping: float, dt: float, at: Floats) -> Floats:
    """Return the amplitude of each mode's deviation per static amplitude, |D(z) - 1|.

    D(z) is the ratio of the mode's amplitude to the static amplitude under a force that oscillates.
    The force is constant within each tick, including the tick in which it is applied.

    Args:
        frequency: Angular frequency of each mode, shape (k,) [rad/s].
        damping: Damping ratio.
        dt: Simulation period N T [s].
        at: Angular frequencies of the force up to the Nyquist frequency, shape (p,) [rad/s].

    Returns:
        Ratio of each mode at each frequency, shape (k, p).
    """
    step = step_of(frequency, damping, dt)
    z = np.exp(-1j * at * dt)  # transfer function of a delay by one tick
    trace = step[:, 0, 0] + step[:, 1, 1]
    det = step[:, 0, 0] * step[:, 1, 1] - step[:, 0, 1] * step[:, 1, 0]
    # First entry of (1 - step z)^-1 step.
    over = step[:, :1, 0] - det[:, None] * z
    under = 1.0 - trace[:, None] * z + det[:, None] * (z * z)
    return np.asarray(np.abs(over / under * (1.0 - z)))


# Lowest frequency at which the ratio is evaluated, as a share of the slowest mode's frequency (at
# the default damping the deviation there is 1 % of the static amplitude), and the number of steps
# up to the Nyquist frequency. A peak has a relative width of twice the damping ratio, at least 4 %.
_LOWEST, _FREQUENCIES = 0.1, 300


@dataclass(frozen=True, eq=False)
class ModalResponse:
    """The static response of a body, and the swing of its modes about the static response.

    Args:
        elastic: Static response of the elastic body.
        modes: Modes of the body.
        along: Static amplitude of each mode per unit force of a load, shape (loads, k) [sqrt(m/N)].
        static: Static amplitude of each mode under the loads, shape (k,) [sqrt(N m)].
        deviation: Deviation of each mode from its static amplitude, and the deviation's speed over
            the mode's angular frequency, shape (k, 2) [sqrt(N m)].
        felt: Share of the swing that hands feel, 0 to 1; users see the whole swing.
    """

    elastic: Response
    modes: Modes
    along: Floats
    static: Floats
    deviation: Floats
    felt: float = 0.0

    @property
    def compliance(self) -> Floats:
        """Static contact compliance C, shape (c, c) [m/N]."""
        return self.elastic.compliance

    @property
    def energy(self) -> float:
        """Energy of the body, elastic and kinetic [J]."""
        e, v = self.deviation.T
        return self.elastic.energy + float(self.static @ e + 0.5 * (e @ e + v @ v))

    @property
    def displacement(self) -> Floats:
        """Displacement of every vertex, shape (n, 3) [m]."""
        swing = np.tensordot(self.deviation[:, 0], self.modes.shapes, axes=1)
        return np.asarray(self.elastic.displacement + swing)

    def displacement_of(self, vertices: Ints) -> Floats:
        """Return the displacement of some vertices with the whole swing, shape (k, 3) [m]."""
        return self.elastic.displacement_of(vertices) + self._swing(vertices)

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """Return the displacement of some vertices as hands feel it, without some loads [m].

        The static displacement by `loads` is left out. The share `felt` of the swing is added,
        including the swing that these loads cause. The result has shape (k, 3).
        """
        left = self.elastic.without(loads, forces, vertices)
        return left + self.felt * self._swing(vertices) if self.felt else left

    def showing(self, fraction: float) -> ModalResponse:
        """Return a copy of the response for the next tick, with a new value of `felt`.

        Args:
            fraction: Share of the swing that hands feel, 0 to 1.
        """
        return replace(self, felt=fraction)

    def _swing(self, vertices: Ints) -> Floats:
        shapes = self.modes.shapes[:, vertices]
        return np.asarray(np.tensordot(self.deviation[:, 0], shapes, axes=1))


class ModalBody:
    """A linear elastic body with inertia, as a `Body`.

    Args:
        elastic: A body whose displacements under several loads add up.
        modes: Lowest modes of the body, on the vertices of its mesh.
        dt: Simulation period N T of the server [s].

    Attributes:
        elastic: As given.
        modes: As given.
        dt: As given.
        swing: Largest ratio |D(z) - 1| of any mode (`swing_of`), for each frequency of a force.
        name: Name of the elastic body.
        mesh: The resting surface.
        contact_radius: Radius of the pressure under a contact [m].
        linear: False, because the body swings on after a load.
    """

    linear = False

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
        """Return the response one tick after `before`, or the static response if that is None."""
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
        """Return the response if a modal body made it, as in `Swings`; None otherwise."""
        return response if isinstance(response, ModalResponse) else None

    def along(self, loads: LoadArrays) -> Floats:
        """Return each mode's static amplitude per unit force of a load, (loads, k) [sqrt(m/N)]."""
        along = np.empty((len(loads.forces), len(self.modes)))
        for i, (a, b) in enumerate(zip(loads.starts.tolist(), loads.ends.tolist(), strict=True)):
            shapes = self.modes.shapes[:, loads.vertices[a:b]]
            along[i] = np.einsum("kvd,v,d->k", shapes, loads.weights[a:b], loads.directions[i])
        return along

    def prefetch(self, vertices: Ints) -> None:
        """Announce the vertices that sliding fingers will press soon, shape (k,)."""
        if isinstance(self.elastic, Prefetching):
            self.elastic.prefetch(vertices)

    def vertex_compliance(self) -> Floats:
        """Return the compliance of a contact at each vertex along its normal, shape (n,) [m/N]."""
        return vertex_compliance(self.elastic)
