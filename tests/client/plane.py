"""A plane to press on and a hand that does: the start of several tests of the client."""

from __future__ import annotations

from cohaptic.control.law import Law
from cohaptic.control.laws.model import LawSettings
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.simulated.hand import Hand, Intention
from cohaptic.vec import ZERO
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig
from cohaptic_client.loop.config import LoopConfig
from cohaptic_client.loop.safety import SafetyLimits

STIFFNESS = 250.0  # N/m
DEPTH = 0.01  # m below the plane is the goal of the hand
PLANE = Patch(
    tick=1, seq=0, t_server=0.0, t_client=0.0, sample_wait=0.0, geometry=Geometry.PLANE,
    law=Law.PREDICTIVE,
    x_free=ZERO, normal=(0.0, 0.0, 1.0), curvature=0.0,
    c_ii=1.0 / STIFFNESS, k_h=STIFFNESS, integral_gain=0.0, own_force=ZERO, u_others=ZERO,
)  # fmt: skip
HAND = Hand()
# Springs in a row: of the hand and of the plane [N].
PRESSED_FORCE = DEPTH / (1.0 / HAND.stiffness + 1.0 / STIFFNESS)
CONFIG = LoopConfig(
    memory="/nowhere",
    clock_origin=12345.5,
    haptic_period=0.001,
    simulation_period=1.0 / 60.0,
    law=LawSettings(),
    smoothing=1.0,
    max_damping=8.0,
    friction=0.0,
    follow=True,
    rest_mesh=None,
    device=DeviceConfig(
        DeviceChoice("simulated"),
        ZERO,
        0.1,
        HAND,
        Intention(
            surface=ZERO,
            direction=(0.0, 0.0, -1.0),
            depth=DEPTH,
            approach_at=0.1,
            approach_time=0.2,
        ),
    ),
    # Engaged soon, so that tests are short; a machine that is busy with other tests is no fault.
    limits=SafetyLimits(engage_time=0.1, stall=1.0),
)
