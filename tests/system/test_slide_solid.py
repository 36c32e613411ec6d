"""A finger that slides over a solid whose columns come while it is on its way."""

from __future__ import annotations

import pytest

from cohaptic_experiments.sliding.slide_solid import ServedSolid, slide
from cohaptic_server.bodies.solid.parts import SolidParts, make_parts
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.testing.soft_ring import fixed, ring

pytestmark = pytest.mark.usefixtures("kernels")

SETTINGS = SolidSettings(order=1)


@pytest.fixture(scope="module")
def mesh() -> TetMesh:
    return ring(120, 32)


@pytest.fixture(scope="module")
def parts(mesh: TetMesh) -> SolidParts:
    """Factored once: nothing that slides changes them."""
    return make_parts(mesh, fixed(mesh), SETTINGS)


@pytest.mark.parametrize(("speed", "delay"), [(0.2, 0.0), (0.02, 0.0), (0.2, 0.15)])
def test_the_force_never_steps(
    speed: float, delay: float, mesh: TetMesh, parts: SolidParts
) -> None:
    """By less than 0.5 % in a haptic period.

    At 0.2 m/s the twin is felt; at 20 mm/s columns come under the finger all the time.
    """
    body = ServedSolid(mesh, fixed(mesh), SETTINGS, parts=parts)
    exact = Solid(mesh, fixed(mesh), SETTINGS, parts=parts)
    # So fine that it is thinned for touching.
    assert len(TouchedBody(body).mesh.vertices) < len(body.mesh.vertices)
    body.in_background()
    found = slide(body, exact, speed=speed, delay=delay)
    assert found.force > 0.5
    assert found.step < 0.005
    assert found.error < 0.08
    assert body.columns.store.kept > 0 or speed > 0.1
    assert found.lost == 0.0 or delay > 0.1


def test_the_force_goes_on_a_long_way_from_the_contact(mesh: TetMesh, parts: SolidParts) -> None:
    """At 250 ms each way a finger is 0.1 m from the contact that its patch was made for.

    The sphere of the patch is 39 mm off there. The vertices that a frame holds are two rows beside
    the path, at whose ends the force changes by up to 1.7 % in a period.
    """
    body = ServedSolid(mesh, fixed(mesh), SETTINGS, parts=parts)
    exact = Solid(mesh, fixed(mesh), SETTINGS, parts=parts)
    body.in_background()
    found = slide(body, exact, speed=0.2, delay=0.25)
    assert found.step < 0.02
    assert found.error < 0.08
