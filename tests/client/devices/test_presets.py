"""What a preset declares is in its mechanics."""

from __future__ import annotations

import pytest

from cohaptic.simulated.hand import Hand, Intention
from cohaptic.vec import ZERO, norm, sub
from cohaptic_client.devices.simulated import PRESETS, SimulatedDevice

FREE = Hand(mass=0.05, damping=0.0, stiffness=1.0)
STILL = Intention(surface=ZERO, direction=(1.0, 0.0, 0.0), depth=0.0, approach_at=1e9)
START = STILL.at(0.0)
T = 0.001  # s


@pytest.fixture(params=list(PRESETS))
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_a_force_below_its_friction_moves_nothing_and_one_above_does(name: str) -> None:
    info = PRESETS[name]
    for share, moves in ((0.9, False), (1.5, True)):
        device = SimulatedDevice(FREE, STILL, info)
        sample = device.read(0.0)
        for n in range(1, 200):
            sample = device.read(n * T)
            device.write((share * info.friction, 0.0, 0.0))
        assert (norm(sub(sample.position, START)) > 2.0 * info.resolution) == moves


def test_it_gives_no_more_than_its_force_and_weighs_what_it_weighs(name: str) -> None:
    info = PRESETS[name]
    device = SimulatedDevice(FREE, STILL, info)
    sample = device.read(0.0)
    device.write((1e3, 0.0, 0.0))
    for n in range(1, 200):
        sample = device.read(n * T)
    way = norm(sub(sample.position, START))
    seen = 0.199 - info.latency
    most = 0.5 * (info.max_force - info.friction) / (FREE.mass + info.inertia) * seen**2
    assert 0.3 * most < way <= 1.02 * most


def test_its_reports_are_steps_of_its_sensors_and_late(name: str) -> None:
    info = PRESETS[name]
    device = SimulatedDevice(FREE, STILL, info)
    for n in range(100):
        sample = device.read(n * T)
        device.write((info.max_force, 0.0, 0.0))
        for x in sample.position:
            assert abs(x / info.resolution - round(x / info.resolution)) < 1e-6
