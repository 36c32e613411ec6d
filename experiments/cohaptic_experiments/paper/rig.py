"""The paper's experimental testbed (section 7): one clamp, one object, simulation at 20 Hz.

The paper's experimenter holds the device at a depth. A compliant hand would lower the gain of the
loop to K_h k / (K_h + k), so the hand here is a clamp: 1e5 N/m, critically damped.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from cohaptic.control.law import Law
from cohaptic.control.laws.model import Thresholds
from cohaptic.protocol.messages import FixedGains
from cohaptic.simulated.hand import Hand, HandScript, Intention
from cohaptic_client.loop.safety import SafetyLimits
from cohaptic_experiments.outcome import Progress
from cohaptic_experiments.paper.recording import Trace, record
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.body import Body

SIMULATION_HZ = 20.0
SIMULATION_PERIOD = 1.0 / SIMULATION_HZ  # N T [s]
_MASS, _STIFFNESS = 0.15, 1e5
CLAMP = Hand(_MASS, 2.0 * math.sqrt(_MASS * _STIFFNESS), _STIFFNESS)
# Wide limits of the safety layer, so that it never acts: the loops are under test, not the layer.
LIMITS = SafetyLimits(max_force=100.0, max_rate=1e6, max_speed=5.0, external_rate=1e6)
# One way: with the pacer's 2 ms, a sample is then a whole period from the surface that it made, for
# which the paper's simulation computes; this server answers at once. To P it is all the same.
COMPUTING = 0.023  # s
START = 1.5  # s; the safety layer has engaged the hand by then
NO_THRESHOLD = Thresholds(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Press:
    """One press of the clamp.

    Args:
        gains: Gains of the law.
        depth: Depth of the probe below the resting surface [m].
        seconds: From the begin of the approach to the end.
        law: Local model.
        approach_time: Short for the paper's step input, long to begin without oscillation [s].
        thresholds: Thresholds of the integral.
        delay: One way [s].
        clearance: Before the approach [m].
    """

    gains: FixedGains
    depth: float
    seconds: float
    law: Law = Law.PROPORTIONAL
    approach_time: float = 0.1
    thresholds: Thresholds = NO_THRESHOLD
    delay: float = 0.0
    clearance: float = 0.01

    @property
    def held_from(self) -> float:
        """When the probe has come to its depth [s]."""
        return START + self.approach_time

    def effective_gain(self) -> float:
        """K_h of clamp and local model in a row [N/m]."""
        return self.gains.k_h / (1.0 + self.gains.k_h / CLAMP.stiffness)

    def intention(self, surface: tuple[float, float, float]) -> Intention:
        """The clamp's way, at a surface that faces +x [m]."""
        return Intention(
            surface,
            (-1.0, 0.0, 0.0),
            self.depth,
            clearance=self.clearance,
            approach_at=START,
            approach_time=self.approach_time,
        )


def press_at_plane(body: Body, press: Press, progress: Progress) -> tuple[Trace, VirtualSession]:
    """Let the clamp press on the body's point that is furthest along +x at y = z = 0.

    As in the paper: zero-order hold of the surface (no smoothing), forced gains, and no passivity
    layer.
    """
    top = float(body.mesh.vertices[:, 0].max())
    intention = press.intention((top, 0.0, 0.0))
    session = VirtualSession(body, SIMULATION_HZ)
    session.join(
        "clamp",
        HandScript(hand=CLAMP),
        law=press.law,
        delay=press.delay,
        fixed_gains=press.gains,
        thresholds=press.thresholds,
        smoothing=0.0,
        passivity=False,
        limits=LIMITS,
        intention=intention,
    )
    trace = record(session, {"clamp": intention}, START + press.seconds, progress)["clamp"]
    return trace, session
