"""Hands deep below a rim, where a mean over vertices is a poor judge of the depth."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cohaptic.protocol.messages import GeometryName
from cohaptic.simulated.hand import HandScript, Intention
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.testing.blocks import block
from cohaptic_server.world.equilibrium import RestingHand, solve

DEPTH = 0.008  # m, as deep as the fingertip is wide
SIDE, HEIGHT = 0.1, 0.06  # m
SECOND = 1000  # haptic periods


@pytest.fixture(scope="module")
def soft_block() -> Solid:
    mesh = block((SIDE, SIDE, HEIGHT), (16, 16, 10))
    settings = SolidSettings(young=8e3, order=1, contact_radius=0.008)
    return Solid(mesh, np.asarray(mesh.vertices[:, 2] < 1e-6), settings)


@pytest.mark.parametrize(
    ("degrees", "geometry", "delay"),
    [(10.0, "mesh", 0.08), (10.0, "plane", 0.25), (30.0, "mesh", 0.25), (30.0, "plane", 0.0)],
)
def test_the_force_is_that_of_the_equilibrium_and_rests(
    soft_block: Solid, degrees: float, geometry: GeometryName, delay: float
) -> None:
    """4 mm from the rim, into the block; with its vertices alone a client was 3 % off."""
    a = math.radians(degrees)
    into = (-math.sin(a), 0.0, -math.cos(a))
    way = Intention((0.5 * SIDE - 0.004, 0.003, HEIGHT), into, DEPTH, approach_at=1.0)
    script = HandScript(angle=0.0, depth=DEPTH)
    expected = solve(soft_block, [RestingHand(way.tip(1.0), script.hand.stiffness)]).force[0]
    session = VirtualSession(soft_block)
    user = session.join("finger", script, intention=way, geometry=geometry, delay=delay)
    session.run(4.0 + 4.0 * delay)
    settled = np.array(user.force[-SECOND:])
    assert settled.mean() == pytest.approx(expected, rel=0.005)
    assert np.ptp(settled) < 0.01 * expected
