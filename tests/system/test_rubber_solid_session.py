"""The nonlinear solid in a world: driven through, and two users who feel each other."""

from __future__ import annotations

import numpy as np
import pytest

from cohaptic.control.law import Law
from cohaptic.vec import Vec3, dot, norm, scale, sub
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid, RubberSolidResponse
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.testing.blocks import grid
from cohaptic_server.world.state import Participant, Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState
from tests.server.bodies.rubber_solid.inversion import least_volume

DT = 1.0 / 60.0  # s
RADIUS = 0.05  # m


def ball(young: float = 2e4, damping: float = 0.0) -> RubberSolid:
    """A ball of soft tissue that stands on its lowest part: a cube of 27 cells, drawn round."""
    line = np.linspace(-1.0, 1.0, 4)
    cube = grid(line, line, line)
    x = cube.vertices
    length = np.maximum(np.linalg.norm(x, axis=1), 1e-12)
    round_ = RADIUS * x * (np.abs(x).max(axis=1) / length)[:, None]
    held = round_[:, 2] < -0.5 * RADIUS
    material = SolidSettings(young, 0.45, 0.015)
    return RubberSolid(TetMesh.checked(round_, cube.tets), held, material, damping=damping)


@pytest.fixture(scope="module")
def soft() -> RubberSolid:
    return ball()


@pytest.mark.parametrize(
    ("way", "young", "limit"),
    [
        ((-1.0, 0.0, 0.0), 2e4, 30.0),
        ((-0.6, 0.64, -0.48), 2e4, 10.0),
        ((0.0, 0.0, -1.0), 4e3, 30.0),
        ((-0.6, 0.64, -0.48), 4e3, 30.0),
    ],
)
def test_a_probe_driven_to_the_opposite_wall_at_one_metre_per_second(
    young: float, way: Vec3, limit: float
) -> None:
    """In, held for half a second, and out again; a device of 10 N, and one of 30 N."""
    body = ball(young)
    state, force, hardest = WorldState(), 0.0, 0.0
    start = scale(way, -1.2 * RADIUS)
    path = [*np.arange(0.0, 0.11, DT), *[0.11] * 30, *np.arange(0.11, -0.03, -DT), *[-0.03] * 90]
    before = np.zeros_like(body.mesh.vertices)
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
        state, patches = advance(TouchedBody(body), state, [touch], now=tick * DT, dt=DT)
        patch = patches[1]
        force = min(limit, max(0.0, patch.k_h * dot(sub(patch.x_free, probe), patch.normal)))
        hardest = max(hardest, norm(patch.own_force))
        response = state.response
        assert isinstance(response, RubberSolidResponse)
        moved = response.displacement
        assert np.isfinite(moved).all()
        assert np.isfinite(response.fields).all()
        assert least_volume(body.shape, response.iterate.state.x) > 0.0
        assert np.abs(moved - before).max() < 0.25 * body.mesh.size
        before = moved
    assert np.abs(before).max() < 1e-6
    assert hardest > (4.0 if young > 1e4 else 1.0)
