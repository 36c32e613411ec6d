"""A loop on a plane, and the patches and probes near it, for the tests of this folder."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import strategies as st

from cohaptic.control.friction import Compliance3
from cohaptic.control.geometry import Sight
from cohaptic.control.law import Law
from cohaptic.protocol.patch import Patch
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.arrival import (
    progress,
    receive,
    shown,
)
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.safety import EXTERNAL_RATE, Mode, SafetyLimits, SafetyState
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.step import step
from tests.client.plane import PLANE, STIFFNESS
from tests.strategies import normals, vectors

PERIOD = 0.001  # s
TICK = 1.0 / 60.0  # s
ROUNDING = 1e-9  # relative; doubles
PACE = EXTERNAL_RATE * PERIOD  # N
# Tips are put where a test wants them.
SETTINGS = LoopSettings(TICK, SafetyLimits(stale=1.0))
# The force of the law is given in full; with the passivity layer and without.
WIDE = [
    LoopSettings(
        TICK,
        SafetyLimits(max_force=1e4, max_rate=1e9, stale=1.0, external_rate=1e9),
        max_damping=b,
    )
    for b in (0.0, 8.0)
]


# Surfaces of a body within reach, and probes near them: forces, not only faults.
near_patches = st.builds(
    replace,
    st.just(PLANE),
    x_free=vectors(0.05),
    normal=normals,
    curvature=st.floats(-20.0, 20.0),
    law=st.sampled_from(Law),
    k_h=st.floats(1.0, 1000.0),
    integral_gain=st.floats(0.0, 5000.0),
    own_force=vectors(10.0),
    u_others=vectors(0.02),
)


probes = vectors(0.1)
# Softer along y than along x; pressing moves the contact along.
ROUGH = replace(PLANE, compliance=Compliance3(0.003, 0.005, 1.0 / STIFFNESS, 1e-3, 1e-3, -1e-3))
samples = st.builds(DeviceSample, position=probes, velocity=vectors(1.0), level=st.just(0.0))


def at(position: Vec3) -> DeviceSample:
    return DeviceSample(position, ZERO)


def engaged(patch: Patch, settings: LoopSettings = SETTINGS, now: float = 10.0) -> LoopState:
    """A loop that got its first patch one tick ago, on a hand that is engaged in full."""
    safety = SafetyState(Mode.ENGAGED, 1.0, ZERO, 4, now - PERIOD)
    return replace(receive(LoopState(), patch, now - TICK, settings), safety=safety)


def play(
    state: LoopState, samples: list[DeviceSample], settings: LoopSettings, now: float
) -> tuple[LoopState, list[Period]]:
    outputs = list[Period]()
    for sample in samples:
        state, output = step(state, sample, now, settings)
        outputs.append(output)
        now += PERIOD
    return state, outputs


def shown_at(state: LoopState, probe: Vec3, now: float, settings: LoopSettings) -> Sight | None:
    """The surface that a loop shows at a time."""
    return shown(state, probe, progress(state, now))
