"""Plates without a closed solution have the limits that are in books, and those of each other."""

from __future__ import annotations

import pytest

import closed_forms
import plate_theory
from closed_forms import Hooke

SOFT = Hooke(1e5, 0.3)
RADIUS, TOUCH = 0.05, 0.008  # m


def test_a_thin_square_plate_under_a_point_is_timoshenkos() -> None:
    thickness = 1e-4 * RADIUS
    D = SOFT.young * thickness**3 / (12.0 * (1.0 - SOFT.nu**2))
    found = plate_theory.square_plate(SOFT, RADIUS, thickness, 0.02 * RADIUS)
    assert found * D / (2.0 * RADIUS) ** 2 == pytest.approx(0.00560, rel=3e-3)


def test_a_square_plate_is_softer_than_a_round_one_in_it_and_stiffer_than_one_round_it() -> None:
    found = plate_theory.square_plate(SOFT, RADIUS, 0.005, TOUCH)
    assert found > closed_forms.clamped_plate(SOFT, RADIUS, 0.005, TOUCH)
    assert found < closed_forms.clamped_plate(SOFT, 2.0**0.5 * RADIUS, 0.005, TOUCH)


def test_a_solid_plate_tends_to_the_theory_as_it_gets_thin() -> None:
    off = [
        plate_theory.round_solid(SOFT, RADIUS, t, TOUCH)
        / closed_forms.clamped_plate(SOFT, RADIUS, t, TOUCH)
        - 1.0
        for t in (0.01, 0.005, 0.0025)
    ]
    assert off[0] < off[1] < off[2] < 0.0
    assert off == pytest.approx([-0.038, -0.0144, -0.0045], abs=5e-4)
