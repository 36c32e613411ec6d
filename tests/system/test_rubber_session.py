"""The nonlinear balloon in a world: driven through, and two users who feel each other."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cohaptic.control.law import Law
from cohaptic.simulated.hand import HandScript
from cohaptic.vec import Vec3, dot, norm, scale, sub
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.balloon.balloon import BalloonSettings
from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon
from cohaptic_server.bodies.newton import CHORD, MAX_MOVE
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.mesh.surface import face_area_vectors
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.equilibrium import (
    RestingHand,
    StickingEquilibrium,
    StickingHand,
    solve,
    solve_sticking,
    touch_down,
)
from cohaptic_server.world.state import Participant, Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState

DT = 1.0 / 60.0  # s


@pytest.fixture(scope="module")
def rubber() -> RubberBalloon:
    """The balloon that is served."""
    return RubberBalloon()


def sharpest_fold(x: Floats, faces: Ints) -> float:
    """Least cosine between the normals of two triangles that share an edge."""
    normals = face_area_vectors(x, faces)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    one, two = (order[start::2] // 3 for start in (0, 1))  # each edge belongs to two triangles
    return float(np.einsum("ei,ei->e", normals[one], normals[two]).min())


def resting(body: RubberBalloon, hands: list[HandScript]) -> list[RestingHand]:
    info = describe(body)
    return [
        RestingHand(s.intention(info.center, info.radius).tip(1.0), s.hand.stiffness) for s in hands
    ]


@pytest.mark.parametrize(
    ("way", "limit"),
    [((-1.0, 0.0, 0.0), 30.0), ((0.0, 0.0, -1.0), 10.0), ((-0.6, 0.64, 0.48), 30.0)],
)
def test_a_probe_driven_to_the_opposite_wall_at_one_metre_per_second(
    rubber: RubberBalloon, way: Vec3, limit: float
) -> None:
    """In, held for a second, and out again; a device of 10 N, and one of 30 N."""
    faces, state = rubber.mesh.faces, WorldState()
    force, hardest, start = 0.0, 0.0, scale(way, -0.12)
    path = [*np.arange(0.0, 0.22, DT), *[0.22] * 60, *np.arange(0.22, -0.03, -DT), *[-0.03] * 90]
    before = np.zeros_like(rubber.mesh.vertices)
    for tick, s in enumerate(path, start=1):
        probe = (start[0] + s * way[0], start[1] + s * way[1], start[2] + s * way[2])
        touch = Touch(
            who=Participant(user=1, law=Law.PREDICTIVE, max_stiffness=2000.0, max_force=limit),
            probe=probe,
            force=scale(way, -force),
            seq=tick,
            tick=tick - 1,
            t_client=tick * DT,
            arrived=tick * DT,
        )
        state, patches = advance(TouchedBody(rubber), state, [touch], now=tick * DT, dt=DT)
        patch = patches[1]
        force = min(limit, max(0.0, patch.k_h * dot(sub(patch.x_free, probe), patch.normal)))
        hardest = max(hardest, norm(patch.own_force))
        assert state.response is not None
        moved = state.response.displacement
        x = rubber.mesh.vertices + moved
        assert np.isfinite(x).all()
        assert np.isfinite(state.response.compliance).all()
        assert abs(volume(x, faces) / rubber.volume - 1.0) < 1e-9
        assert np.abs(moved - before).max() < 1.05 * MAX_MOVE + CHORD
        # No triangle is folded onto its neighbour. Under 10 N normals turn by less than 90 degrees;
        # 30 N on one place, more than such a balloon carries, crease it by up to 120.
        assert sharpest_fold(x, faces) > (0.0 if limit <= 10.0 else -0.6)
        before = moved
    assert np.abs(before).max() < 1e-4
    assert hardest > 4.0


@pytest.mark.parametrize(("damping", "sway"), [(0.0, 0.02), (2.0, 0.15)])
def test_three_deep_hands_settle_at_the_reference(damping: float, sway: float) -> None:
    """Contacts do not throw each other to and fro on a body that softens.

    Three hands of 3 cm press with 7 N each, with 50 ms of delay. On a viscous body they sway for
    some seconds: the force that they feel contains their own earlier force.
    """
    coarse = BalloonSettings(subdivisions=2, contact_radius=0.03)
    body = RubberBalloon(coarse, damping=damping)
    hands = [HandScript(2.0 * math.pi * i / 3.0 - math.pi, depth=0.03) for i in range(3)]
    session = VirtualSession(body)
    for i, script in enumerate(hands):
        session.join(f"user{i}", script, delay=0.05, seed=i)
    session.run(6.0)
    expected = solve(RubberBalloon(coarse), resting(body, hands))
    for i, user in enumerate(session.users.values()):
        assert user.force[-1] == pytest.approx(expected.force[i], rel=0.02)
        assert np.ptp(user.force[-500:]) < sway


@pytest.mark.parametrize(("friction", "off"), [(0.0, 0.01), (0.6, 0.15)])
def test_meshes_and_friction_work_on_it_too(
    rubber: RubberBalloon, friction: float, off: float
) -> None:
    """Patches cut from the bent surface; and three loads of a contact, one normal, two along it.

    With friction the reference is that of hands that stick. At 20 mm, where the surface tilts under
    the fingers by 12 degrees, the client's friction is 14 % below it; why is not known yet.
    """
    hands = [HandScript(math.pi + math.pi * i, depth=0.02) for i in range(2)]
    session = VirtualSession(rubber)
    for i, script in enumerate(hands):
        session.join(f"u{i}", script, delay=0.04, seed=i, geometry="mesh", friction=friction)
    session.run(4.0)
    if friction:
        info, none = describe(rubber), StickingEquilibrium(np.zeros((0, 3)), np.zeros((0, 3)), None)
        ways = [script.intention(info.center, info.radius) for script in hands]
        stuck = [
            StickingHand(
                way.tip(1.0),
                script.hand.stiffness,
                touch_down(rubber, np.array(way.tip(0.0)), np.array(way.direction), none),
            )
            for way, script in zip(ways, hands, strict=True)
        ]
        expected = np.linalg.norm(solve_sticking(rubber, stuck).force, axis=1)
    else:
        expected = solve(rubber, resting(rubber, hands)).force
    for i, user in enumerate(session.users.values()):
        assert user.force[-1] == pytest.approx(expected[i], rel=off)
        assert np.ptp(user.force[-300:]) < 0.01
