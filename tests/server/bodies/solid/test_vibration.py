from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cohaptic_server.bodies.solid.shape import SolidSettings, shape_of
from cohaptic_server.bodies.solid.vibration import lowest_frequency, lumped_mass
from cohaptic_server.testing.blocks import block

BEAM = block((0.02, 0.02, 0.2), (2, 2, 12))
FOOT = BEAM.vertices[:, 2] <= 0.0
SETTINGS = SolidSettings(young=1e5, nu=0.3)


@pytest.mark.parametrize("order", [1, 2])
def test_the_lumped_mass_is_the_whole_mass(order: int) -> None:
    shape = shape_of(BEAM, FOOT, replace(SETTINGS, order=order))
    mass = lumped_mass(shape, 1100.0)
    assert mass.sum() == pytest.approx(1100.0 * 0.02 * 0.02 * 0.2)
    assert (mass > 0.0).all()


def test_a_clamped_beam_swings_as_the_books_say() -> None:
    """Euler and Bernoulli: 1.8751^2 / (2 pi L^2) sqrt(E I / (rho A)); L is ten thicknesses."""
    found = lowest_frequency(shape_of(BEAM, FOOT, SETTINGS), 1000.0)
    inertia, area = 0.02**4 / 12.0, 0.02**2
    expected = 1.8751**2 / (2 * np.pi * 0.2**2) * np.sqrt(1e5 * inertia / (1000.0 * area))
    # Shear and rotary inertia take 2 % at this length; what is left is the mesh's.
    assert found == pytest.approx(expected, rel=0.03)


def test_it_goes_with_the_root_of_stiffness_over_mass() -> None:
    shape = shape_of(BEAM, FOOT, SETTINGS)
    one = lowest_frequency(shape, 1000.0)
    assert lowest_frequency(shape, 4000.0) == pytest.approx(0.5 * one, rel=1e-6)
    stiff = shape_of(BEAM, FOOT, replace(SETTINGS, young=9e5))
    assert lowest_frequency(stiff, 1000.0) == pytest.approx(3.0 * one, rel=1e-6)
