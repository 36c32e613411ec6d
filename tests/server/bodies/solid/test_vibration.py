from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.bodies.solid.shape import SolidSettings, shape_of
from cohaptic_server.bodies.solid.vibration import lowest_frequency
from cohaptic_server.testing.blocks import block

BEAM = block((0.02, 0.02, 0.2), (2, 2, 12))
FOOT = BEAM.vertices[:, 2] <= 0.0
SETTINGS = SolidSettings(young=1e5, nu=0.3)


def test_a_clamped_beam_swings_as_the_books_say() -> None:
    """Euler and Bernoulli: 1.8751^2 / (2 pi L^2) sqrt(E I / (rho A)); L is ten thicknesses."""
    found = lowest_frequency(shape_of(BEAM, FOOT, SETTINGS), 1000.0)
    inertia, area = 0.02**4 / 12.0, 0.02**2
    expected = 1.8751**2 / (2 * np.pi * 0.2**2) * np.sqrt(1e5 * inertia / (1000.0 * area))
    # Shear and rotary inertia take 2 % at this length; what is left is the mesh's.
    assert found == pytest.approx(expected, rel=0.03)
