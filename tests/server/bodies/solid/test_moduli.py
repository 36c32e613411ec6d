"""Solids of several materials: a patch test, and what a tick needs of them."""

from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.bodies.green import green_source, model_name
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.solid.parts import stiffness_of
from cohaptic_server.bodies.solid.shape import MAX_CONTRAST, Moduli, SolidSettings, shape_of
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.testing.blocks import block
from tests.server.bodies.presses import press

BAR = block((0.2, 0.04, 0.04), (6, 2, 2))
FAR = (BAR.vertices[BAR.tets].mean(axis=1)[:, 0] > 0.0).astype(np.int64)
HELD = BAR.vertices[:, 0] < -0.0999


def in_series(young: tuple[float, float], nu: tuple[float, float]) -> Moduli:
    return Moduli(np.array(young)[FAR], np.array(nu)[FAR])


@pytest.mark.parametrize("order", [1, 2])
def test_a_bar_in_series_has_an_even_stress(order: int) -> None:
    """A patch test: nu over E is the same, so both halves narrow alike, and no corner is pulled."""
    moduli = in_series((1e5, 2e4), (0.4, 0.08))
    shape = shape_of(BAR, HELD, SolidSettings(order=order), moduli)
    x, stress = shape.nodes, 100.0
    young = np.where(x[:, 0] > 0.0, 2e4, 1e5)
    u = np.stack(
        [stress * x[:, 0] / young, *(-stress * 0.4 / 1e5 * x[:, k] for k in (1, 2))], axis=1
    )
    force = (stiffness_of(shape) @ u.ravel()).reshape(-1, 3)
    ends = np.abs(np.abs(x[:, 0]) - 0.1) < 1e-9
    assert np.abs(force[~ends]).max() < 1e-12 * np.abs(force).max()
    assert force[x[:, 0] > 0.0999, 0].sum() == pytest.approx(stress * 0.04**2)


@pytest.mark.parametrize("order", [1, 2])
def test_the_tangent_of_rubber_at_rest_is_the_linear_stiffness(order: int) -> None:
    settings, moduli = SolidSettings(order=order), in_series((1e5, 2e4), (0.3, 0.45))
    linear = Solid(BAR, HELD, settings, moduli=moduli)
    rubber = RubberSolid(BAR, HELD, settings, moduli=moduli)
    wanted = linear.respond([press(linear, (1, 0.2, 0.3), 1e-4)])
    found = rubber.respond([press(rubber, (1, 0.2, 0.3), 1e-4)])
    assert found.compliance == pytest.approx(wanted.compliance, rel=1e-3)


def test_a_soft_half_is_felt_where_it_is_and_names_another_model() -> None:
    even = Solid(BAR, HELD, SolidSettings(order=1))
    mixed = Solid(BAR, HELD, SolidSettings(order=1), moduli=in_series((2e4, 2e3), (0.45, 0.45)))
    tables = [solid.vertex_compliance() for solid in (even, mixed)]
    x = even.mesh.vertices[:, 0]
    ratio = tables[1][x > -0.0999] / tables[0][x > -0.0999]
    x = x[x > -0.0999]
    # At the tip much of what gives way is the stiff half.
    assert ratio[x > 0.05].min() > 1.5
    assert ratio[x < -0.05] == pytest.approx(1.0, abs=0.1)
    names = [model_name(source) for body in (even, mixed) if (source := green_source(body))]
    assert len(set(names)) == 2


@pytest.mark.parametrize("contrast", [1e3, MAX_CONTRAST])
def test_a_large_contrast_is_solved_to_the_digits_that_a_tick_has(contrast: float) -> None:
    moduli = in_series((2e3 * contrast, 2e3), (0.3, 0.45))
    solid = Solid(BAR, HELD, SolidSettings(), moduli=moduli)
    shape = solid.shape
    load = press(solid, (1, 0.2, 0.3), 1.0)
    dof = (3 * np.flatnonzero(~shape.fixed)[:, None] + np.arange(3)).ravel()
    force = np.zeros((len(shape.nodes), 3))
    force[shape.surface[load.vertices]] = load.weights[:, None] * load.direction
    f = force.ravel()[dof]
    exact = f @ np.linalg.solve(stiffness_of(shape)[dof][:, dof].toarray(), f)
    assert solid.respond([load]).compliance[0, 0] == pytest.approx(exact, rel=1e-4)
