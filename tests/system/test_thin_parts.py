"""Fingers on parts that are thinner than a press is deep."""

from __future__ import annotations

import numpy as np
import pytest

from cohaptic.protocol.messages import GeometryName
from cohaptic.protocol.patch import MAX_COMPLIANCE
from cohaptic.simulated.hand import HandScript
from cohaptic.vec import Vec3
from cohaptic_experiments.sliding.slide import GuidedHand
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.testing.blocks import block

THICK = 0.003  # m
DEPTH = 0.004  # m of a press, which is more than that
RADIUS = 0.008  # m, of a fingertip
PRESSED = 1.5  # s from which on the finger stays


class Dip:
    """A way straight onto the middle of the plate, and there it stays.

    Args:
        face: Height of the pressed face [m].
        depth: Below it [m].
        out: 1 for the upper face, -1 for the lower one.
    """

    def __init__(self, face: float, depth: float = DEPTH, out: float = 1.0) -> None:
        self.face, self.depth, self.out = face, depth, out

    def position(self, t: float) -> Vec3:
        """Position of the tip [m]."""
        fraction = min(1.0, max(0.0, t - 0.3))
        return (0.001, 0.002, self.face + self.out * (0.01 - (0.01 + self.depth) * fraction))


@pytest.fixture(scope="module")
def plate() -> Solid:
    """A plate of 12 cm that is held at its rim."""
    mesh = block((0.12, 0.12, THICK), (24, 24, 2))
    held = (np.abs(mesh.vertices[:, :2]) > 0.058).any(axis=1)
    return Solid(mesh, np.asarray(held), SolidSettings(young=5e5, order=1, contact_radius=RADIUS))


@pytest.mark.parametrize("delay", [0.0, 0.08])
@pytest.mark.parametrize("geometry", ["plane", "sphere", "mesh"])
def test_a_press_deeper_than_a_plate_is_an_ordinary_contact(
    plate: Solid, geometry: GeometryName, delay: float
) -> None:
    session = VirtualSession(plate)
    top = float(plate.mesh.vertices[:, 2].max())
    hand = GuidedHand(Dip(top))
    user = session.join(
        "finger", HandScript(angle=0.0, depth=DEPTH), device=hand, geometry=geometry, delay=delay
    )
    session.run(PRESSED + 4.0 * delay)
    state = session.room.world.users[user.number]
    normal = plate.respond([state.contact.load(1.0)]).compliance[0, 0]
    assert state.contact.places[2][2] == pytest.approx(1.0, abs=1e-3)
    assert user.force[-1] == pytest.approx(DEPTH / normal, rel=0.02)
    # On the way in the force follows the depth, and does not let go in between.
    force = np.array(user.force)
    assert np.diff(force).min() > -0.02 * force[-1]


def test_the_far_side_carries_nothing(plate: Solid) -> None:
    session = VirtualSession(plate)
    top = float(plate.mesh.vertices[:, 2].max())
    user = session.join(
        "finger", HandScript(angle=0.0, depth=DEPTH), device=GuidedHand(Dip(top)), geometry="mesh"
    )
    session.run(PRESSED)
    state = session.room.world.users[user.number]
    z = plate.mesh.vertices[state.contact.vertices, 2]
    assert state.contact.weights[z < top - 0.5 * THICK].sum() == 0.0
    patch = session.room.patches[user.number]
    assert patch.neighbourhood is not None
    points = session.room.touched_body.mesh.points
    carried = points[list(patch.neighbourhood.indices)]
    assert len(carried) > 20
    assert carried[:, 2].min() > top - 1e-6
    # As many of the far side are as near, so that a ball would have taken them.
    reach = float(np.abs(carried[:, :2]).max())
    far = points[points[:, 2] < top - 0.5 * THICK]
    assert (np.abs(far[:, :2]).max(axis=1) <= reach).sum() > 20


@pytest.mark.parametrize("delay", [0.0, 0.08])
@pytest.mark.parametrize("geometry", ["plane", "sphere", "mesh"])
def test_two_fingers_that_pinch_a_plate_stay_opposite_to_each_other(
    plate: Solid, geometry: GeometryName, delay: float
) -> None:
    """Alone, each would bend the plate by centimetres: its bulge is sharper than it is deep."""
    session = VirtualSession(plate)
    heights = plate.mesh.vertices[:, 2]
    users = [
        session.join(
            name,
            HandScript(angle=0.0, depth=DEPTH),
            device=GuidedHand(Dip(face, DEPTH, out)),
            geometry=geometry,
            delay=delay,
        )
        for name, face, out in (
            ("above", float(heights.max()), 1.0),
            ("below", float(heights.min()), -1.0),
        )
    ]
    session.run(PRESSED + 2.0)
    states = session.room.world.users
    one, other = (np.array(states[user.number].contact.places[1]) for user in users)
    assert np.linalg.norm(one[:2] - other[:2]) < 0.1 * RADIUS
    for user in users:
        # The plate is stiff against a pinch, and the force comes up to that in small steps.
        force = np.array(user.force[round(1e3 * PRESSED) :])
        assert force[-1] > 2.0
        assert np.diff(force).min() > -1e-3 * force[-1]


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_place_too_soft_for_the_wire_ends_nobodys_session(friction: float) -> None:
    """A flap of 10 Pa: a newton would move it by many metres."""
    mesh = block((0.1, 0.1, 0.004), (10, 10, 1))
    held = np.asarray(mesh.vertices[:, 0] < -0.045)
    flap = Solid(mesh, held, SolidSettings(young=10.0, order=1, contact_radius=RADIUS))
    top = float(flap.mesh.vertices[:, 2].max())
    session = VirtualSession(flap)
    hand = GuidedHand(Dip(top, 0.01))
    script = HandScript(angle=0.0, depth=DEPTH)
    user = session.join("finger", script, device=hand, geometry="mesh", friction=friction)
    session.run(PRESSED)
    contact = session.room.world.users[user.number].contact
    assert flap.respond([contact.load(1.0)]).compliance[0, 0] > MAX_COMPLIANCE
    assert session.room.patches[user.number].c_ii <= MAX_COMPLIANCE
    assert max(user.force) < 0.01
