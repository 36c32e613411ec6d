from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.spring import Spring
from cohaptic_server.bodies.viscous import Viscous
from cohaptic_server.testing import BrokenLawError, check_body
from cohaptic_server.testing.blocks import block
from cohaptic_server.testing.check_body import LAWS
from tests.server.testing.broken_bodies import BALLOON, BROKEN, Changed, unchanged

SMALL = BalloonSettings(subdivisions=2, contact_radius=0.03)
MESH = block((0.1, 0.08, 0.06), (3, 3, 2))
MESH.vertices[:] += np.random.default_rng(1).uniform(-0.004, 0.004, MESH.vertices.shape)
FIXED = MESH.vertices[:, 2] < 0.005


def material(order: int) -> SolidSettings:
    return SolidSettings(2e4, 0.45, 0.015, order)


LINEAR: dict[str, Callable[[], Body]] = {
    "spring": Spring,
    "balloon": lambda: BALLOON,
    "damped balloon": lambda: Balloon(SMALL, damping=1.0),
    "solid of order 1": lambda: Solid(MESH, FIXED, material(1)),
    "solid of order 2": lambda: Solid(MESH, FIXED, material(2)),
    "viscous solid": lambda: Viscous(Solid(MESH, FIXED, material(1)), 1.0),
    "viscous balloon": lambda: Viscous(BALLOON, 2.0),
}
NONLINEAR: dict[str, Callable[[], Body]] = {
    "rubber balloon": lambda: RubberBalloon(SMALL),
    "damped rubber balloon": lambda: RubberBalloon(SMALL, damping=1.0),
    "rubber solid of order 1": lambda: RubberSolid(MESH, FIXED, material(1)),
    "rubber solid of order 2": lambda: RubberSolid(MESH, FIXED, material(2)),
    "damped rubber solid": lambda: RubberSolid(MESH, FIXED, material(1), damping=1.0),
}


@pytest.mark.parametrize("name", LINEAR)
def test_every_linear_body_keeps_the_laws(name: str) -> None:
    check_body(LINEAR[name](), linear=True)


@pytest.mark.parametrize("name", NONLINEAR)
def test_every_nonlinear_body_keeps_the_laws(name: str) -> None:
    check_body(NONLINEAR[name]())


@pytest.mark.parametrize("law", BROKEN)
def test_each_law_is_seen_to_fail(law: str) -> None:
    make, linear = BROKEN[law]
    with pytest.raises(BrokenLawError) as error:
        check_body(make(), linear=linear)
    assert error.value.law == law


def test_no_law_is_without_a_body_that_breaks_it() -> None:
    assert {law.__name__ for law in LAWS} == set(BROKEN)
    check_body(Changed(unchanged))
