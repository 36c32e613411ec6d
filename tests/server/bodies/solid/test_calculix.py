from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.testing.blocks import block
from cohaptic_server.world.contact import locate
from tests.give_up import give_up
from tests.server.bodies.solid import calculix

pytestmark = pytest.mark.live


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("nu", [0.3, 0.48])
def test_calculix_has_the_same_displacement(order: int, nu: float, tmp_path: Path) -> None:
    """The same mesh, material and forces in a program that shares no line with ours."""
    if calculix.CCX is None:
        give_up("CalculiX is not here: apt-get install calculix-ccx")
    mesh = block((0.1, 0.08, 0.06), (5, 4, 4))
    mesh.vertices[:] += np.random.default_rng(3).uniform(-0.003, 0.003, mesh.vertices.shape)
    body = Solid(mesh, mesh.vertices[:, 2] < 0.004, SolidSettings(2e4, nu, 0.012, order))
    free = np.zeros_like(body.mesh.vertices)
    loads = [
        locate(body.mesh, np.array(at), free, radius=body.contact_radius).load(force)
        for at, force in (((0.01, 0.01, 0.1), 1.0), ((0.1, 0.0, 0.04), 2.0))
    ]
    ours = body.respond(loads).displacement
    theirs = calculix.displacement(body, loads, tmp_path)[body.shape.surface]
    assert np.abs(ours - theirs).max() < 0.005 * np.abs(theirs).max()
    for load in loads:
        moved = [load.weights @ (u[load.vertices] @ load.direction) for u in (ours, theirs)]
        assert moved[0] == pytest.approx(moved[1], rel=0.005)
