"""How well the force follows a hand that slides over a body, by geometry, speed and delay.

A stiff hand follows a prescribed path: it dips below the resting surface, slides at a constant
depth, and comes out. The force that it felt is compared with that of the body at the same position
and time, without a network in between (science 3.7).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from cohaptic.control.law import Law
from cohaptic.protocol.messages import GeometryName
from cohaptic.simulated.hand import HandScript, ease
from cohaptic.vec import Vec3, add, scale
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.loop.safety import SafetyLimits
from cohaptic_experiments.virtual_session import PERIOD, VirtualSession
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.contact import Contact, locate

CLEARANCE = 0.01  # m above the surface before and after
DIP = 1.0  # s from there to the full depth
REST = 1.5  # s in front of the surface, while the safety layer engages the hand
SPEED_UP = 0.5  # s to the full speed
SETTLE = 0.2  # s at full depth, and at full speed, beside the delays


@dataclass(frozen=True, slots=True)
class Way:
    """A slide along a circle round the body, as an angle and a height over time.

    Args:
        center: Centre of the circle [m].
        radius: Radius of the resting surface [m].
        depth: Below it while sliding [m].
        speed: Speed of the point of the surface that is touched [m/s].
        angle: That is slid over in steady sliding [rad].
        delay: One way; patches are that old, so sliding is steady that much later [s].
        upwards: From the equator over the pole instead of along the equator.
    """

    center: Vec3
    radius: float
    depth: float
    speed: float
    angle: float
    delay: float
    upwards: bool = False

    @property
    def rate(self) -> float:
        """Angular speed [rad/s]."""
        return self.speed / self.radius

    @property
    def start(self) -> float:
        """When the slide begins [s]."""
        return REST + DIP + SETTLE + 2.0 * self.delay

    @property
    def steady(self) -> tuple[float, float]:
        """From when to when every patch in use was made at full speed [s]."""
        begins = self.start + SPEED_UP + SETTLE + 2.0 * self.delay
        return begins, begins + (self.angle / self.rate if self.rate else 1.0)

    @property
    def end(self) -> float:
        """When the hand is out again [s]."""
        return self.steady[1] + SPEED_UP + DIP

    def position(self, t: float) -> Vec3:
        """Where the tip is at `t` [m]."""
        angle = self.rate * self._slid(t)
        dip = ease((t - REST) / DIP) * (1.0 - ease((t - self.steady[1] - SPEED_UP) / DIP))
        reach = self.radius + CLEARANCE - (CLEARANCE + self.depth) * dip
        way, height = (0.0, math.sin(angle)) if self.upwards else (math.sin(angle), 0.0)
        return add(self.center, scale((math.cos(angle), way, height), reach))

    def _slid(self, t: float) -> float:
        """Integral of the speed's share, from its start [s]."""
        return _ramp(t - self.start) - _ramp(t - self.steady[1])


class Path(Protocol):
    """Where a tip is at any time."""

    def position(self, t: float) -> Vec3:
        """Position at a time [m]."""
        ...


class GuidedHand:
    """A device whose tip follows a given path under any force.

    Args:
        way: Way of the tip; its time starts with the first `read`.
    """

    info = DeviceInfo("guided", max_force=100.0, max_stiffness=1e5, damping=1e3)

    def __init__(self, way: Path) -> None:
        self._way = way
        self._start: float | None = None

    def read(self, now: float) -> DeviceSample:
        """The tip at `now`."""
        self._start = now if self._start is None else self._start
        t = now - self._start
        before, position = self._way.position(t - PERIOD), self._way.position(t)
        velocity = tuple((b - a) / PERIOD for a, b in zip(before, position, strict=True))
        return DeviceSample(position, (velocity[0], velocity[1], velocity[2]))

    def write(self, force: Vec3) -> None:
        """Ignore the force."""

    def close(self) -> None:
        """Nothing to release."""


@dataclass(frozen=True, slots=True)
class SlideResult:
    """Error of the force in steady sliding, against the reference.

    Args:
        geometry: Geometry of the patches.
        speed: Speed of the slide [m/s].
        delay: One way [s].
        median: Median of the error of the normal force, as a share of the true one.
        p95: 95th percentile of the same, 95 of 100 periods are below it.
        worst: Largest.
        step: Largest change of the force between two periods of 1 ms, as a share of the force.
        start: Largest error while it gets up to speed, with patches that were made before.
        force: Mean true normal force [N].
    """

    geometry: str
    speed: float
    delay: float
    median: float
    p95: float
    worst: float
    step: float
    start: float
    force: float


def measure(
    geometry: GeometryName,
    speed: float,
    delay: float,
    *,
    body: Body,
    depth: float = 0.010,
    angle: float = math.pi / 2.0,
    upwards: bool = False,
) -> SlideResult:
    """Slide over a body with one geometry.

    Args:
        geometry: Geometry of the patches.
        speed: Speed of the point that is touched [m/s].
        delay: One way [s].
        body: To be slid over.
        depth: Below the resting surface [m].
        angle: To be slid over in steady sliding [rad].
        upwards: From the equator over the pole instead of along the equator.
    """
    about = describe(body)
    way = Way(about.center, about.radius, depth, speed, angle, delay, upwards)
    forces = felt_along(body, way, geometry)
    # The first period is the device's time 0.
    first, middle, last = (round(t / PERIOD) for t in (way.start, *way.steady))
    felt = forces[first:last]
    reference = true_forces(body, [way.position(i * PERIOD) for i in range(first, last)])
    errors = np.abs(felt - reference) / reference
    starting, error = np.split(errors, [middle - first])
    change = (np.abs(np.diff(felt)) / reference[1:])[middle - first :]
    return SlideResult(
        geometry,
        speed,
        delay,
        float(np.median(error)),
        float(np.quantile(error, 0.95)),
        float(error.max()),
        float(change.max()),
        float(starting.max()),
        float(reference.mean()),
    )


def felt_along(body: Body, way: Way, geometry: GeometryName) -> Floats:
    """Force on a hand that is guided along a way, in every period of it, shape (k,) [N]."""
    session = VirtualSession(body)
    user = session.join(
        "hand",
        HandScript(),
        law=Law.PREDICTIVE,
        delay=way.delay,
        # No limit may clip the force, since it is the measured quantity.
        limits=replace(SafetyLimits(), max_force=100.0, max_rate=1e6),
        geometry=geometry,
        device=GuidedHand(way),
    )
    session.run(way.steady[1])
    return np.array(user.force)


def true_forces(body: Body, tips: list[Vec3]) -> Floats:
    """Normal force of a lone hand at each tip: depth in the free surface over C_ii, at once [N].

    The surface free of its own force is the resting one for every body that is linear.
    """
    free = np.zeros_like(body.mesh.vertices)
    contact: Contact | None = None
    forces: list[float] = []
    for tip in tips:
        probe = np.array(tip)
        contact = locate(body.mesh, probe, free, radius=body.contact_radius, hint=contact)
        c_ii = body.respond([contact.load(0.0)]).compliance[0, 0]
        forces.append(max(0.0, float(contact.normal @ (contact.point - probe))) / float(c_ii))
    return np.array(forces)


def _ramp(t: float) -> float:
    """Integral of a share that rises from 0 to 1 in `SPEED_UP` [s]."""
    s = min(1.0, max(0.0, t / SPEED_UP))
    return SPEED_UP * (s**3 - 0.5 * s**4) + max(0.0, t - SPEED_UP)
