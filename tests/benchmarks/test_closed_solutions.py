"""Objects from files agree with closed solutions; all edges are in `docs/results.md`."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest

import clamped_plates
import closed_forms
import closed_solutions
import plate_theory
from closed_forms import Hooke
from closed_solutions import HOOKE

pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]' fills surfaces")


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))


@pytest.mark.night
@pytest.mark.parametrize(
    ("case", "edge"),
    [
        ("cantilever", 0.03),
        ("fingertip", 0.05),
        ("punch", 0.04),
        # At the default edge; the plates are one element thick there, or less.
        ("cantilever", 0.05),
        ("plate", 0.05),
        ("thin square plate", 0.05),
    ],
)
def test_a_file_agrees_with_the_closed_solution(case: str, edge: float, tmp_path: Path) -> None:
    row = closed_solutions.run(case, edge, tmp_path)
    assert abs(float(row["error"] or 1.0)) < 0.03


@pytest.mark.night
@pytest.mark.parametrize(
    "thickness",
    [
        0.01,
        pytest.param(0.005, marks=pytest.mark.night),  # half a minute each, between the two others
        pytest.param(0.0025, marks=pytest.mark.night),
        0.001,
    ],
)
def test_plates_from_thick_to_thin_are_near_a_solid_at_the_default_edge(
    thickness: float, tmp_path: Path
) -> None:
    """A clamped solid is stiffer than a plate of the theory, the more the thicker it is."""
    assert -0.021 < _beside_a_solid(thickness, 0.05, tmp_path) < 0.003


@pytest.mark.night
def test_a_plate_gets_nearer_to_a_solid_with_each_shorter_edge(tmp_path: Path) -> None:
    """Also where it stops being thin: 0.018 has 1.6 edges through the thickness.

    There the error was twice that at 0.025.
    """
    off = [_beside_a_solid(0.005, edge, tmp_path) for edge in (0.1, 0.05, 0.025, 0.018)]
    # Two runs of fTetWild differ by a thousandth.
    assert all(b > a - 5e-4 for a, b in itertools.pairwise(off))
    assert abs(off[-1]) < 0.2 * abs(off[0])


def _beside_a_solid(thickness: float, edge: float, folder: Path) -> float:
    """Error of the compliance of the clamped round plate in a file, beside elasticity's."""
    plate = closed_solutions.Case(
        clamped_plates.round_plate(HOOKE, thickness),
        (edge,),
        clamped_plates.bend(thickness),
        plate_theory.round_solid(HOOKE, clamped_plates.CLAMP, thickness, clamped_plates.TOUCH),
    )
    row = closed_solutions.run("plate", edge, folder, {"plate": plate})
    return float(row["error"] or math.nan)


def test_closed_forms_have_the_limits_that_are_in_books() -> None:
    soft = Hooke(1e5, 0.3)
    a, E = 0.01, soft.young / (1.0 - soft.nu**2)
    assert closed_forms.punch(soft, math.inf, a) == pytest.approx(2.0 * a * E, rel=1e-3)
    # Weber's integral of J2^2 / x^4 over the half line.
    weber = 6.0 * math.gamma(0.5) / (16.0 * math.gamma(2.5) ** 2 * math.gamma(4.5))
    half_space = 64.0 * weber / (math.pi * E * a)
    assert closed_forms.layer(soft, math.inf, a) == pytest.approx(half_space, rel=1e-4)
    assert closed_forms.layer(soft, 1e3 * a, a) == pytest.approx(half_space, rel=2e-3)
    # A layer far thinner than the contact is squeezed without spreading: mean of p^2 over a disc.
    bulk = soft.young * 0.7 / (1.3 * 0.4)
    squeezed = 0.01 * a / bulk * 4.0 / (3.0 * math.pi * a**2)
    assert closed_forms.layer(soft, 0.01 * a, a) == pytest.approx(squeezed, rel=0.02)
    # Kirchhoff's plate under a force at a point.
    thin = 1e-3 * a
    D = soft.young * thin**3 / (12.0 * (1.0 - soft.nu**2))
    point = a**2 / (16.0 * math.pi * D)
    assert closed_forms.clamped_plate(soft, a, thin, thin) == pytest.approx(point, rel=1e-3)


@pytest.mark.parametrize("order", [0.7, 1.0, 2.0, 3.5])
def test_the_limit_and_the_order_of_a_power_are_found(order: float) -> None:
    sizes = [0.9, 0.5, 0.31, 0.2]
    values = [3.0 - 0.4 * size**order for size in sizes]
    assert closed_solutions.limit(sizes, values) == pytest.approx((3.0, order))
    value, unknown = closed_solutions.limit(sizes, [1.0, 1.1, 1.0, 1.2])
    assert value == 1.2
    assert math.isnan(unknown)
