from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.vec import Vec3, dot, norm, scale
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.placing.workspace import Workspace, seen_from_world
from tests.strategies import vectors

TIGHT = 1e-9
points = vectors(1.0)
workspaces = st.builds(
    Workspace, points, points, st.floats(0.2, 5.0), st.floats(-2.0 * math.pi, 2.0 * math.pi)
)


@given(workspaces, points, points)
def test_the_hand_gets_the_force_in_full_and_the_power_by_the_scale(
    workspace: Workspace, velocity: Vec3, force: Vec3
) -> None:
    """A limit in newtons holds on the hand, and what is passive in the world stays so in it."""
    given_force = workspace.force(force)
    assert norm(given_force) == pytest.approx(norm(force), abs=TIGHT)
    power = dot(force, workspace.velocity(velocity))
    assert workspace.scale * dot(given_force, velocity) == pytest.approx(power, abs=TIGHT)


@given(workspaces, points, st.floats(1.0, 1000.0))
def test_a_device_renders_the_stiffness_that_it_says_it_has_in_the_world(
    workspace: Workspace, step: Vec3, stiffness: float
) -> None:
    info = DeviceInfo("arm", max_force=3.0, max_stiffness=stiffness, damping=2.0, resolution=1e-4)
    world = seen_from_world(info, workspace.scale)
    force = workspace.force(scale(workspace.velocity(step), -world.max_stiffness))
    assert force == pytest.approx(scale(step, -stiffness), rel=1e-9, abs=TIGHT * stiffness)
    assert world.max_force == info.max_force
    assert world.damping == pytest.approx(info.damping / workspace.scale)
    assert world.resolution == pytest.approx(info.resolution * workspace.scale)
