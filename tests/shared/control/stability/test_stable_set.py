from __future__ import annotations

import numpy as np
import pytest

from cohaptic.control.stability.single_contact import elastic_object, integral_model, lifted_radius
from cohaptic.control.stability.stable_set import closed_edges, lifted_edges, stability_area


@pytest.mark.parametrize("b_o", [0.0, 0.4])
def test_edges_closed_and_lifted_are_one(b_o: float) -> None:
    k_h = np.array([0.1, 0.9, 1.3, 2.4, 2.995, 3.7, 5.0])
    closed, lifted = closed_edges(k_h, 1.0, b_o), lifted_edges(k_h, 1.0, b_o)
    for a, b in zip(closed, lifted, strict=True):
        assert b == pytest.approx(a, abs=1e-6, nan_ok=True)
    assert np.isnan(lifted[0][-1])
    assert not np.isnan(lifted[0][:5]).any()


def area(polygon: np.ndarray) -> float:
    x, y = polygon.T
    return 0.5 * abs(float(x[:-1] @ y[1:] - x[1:] @ y[:-1]))


def test_the_area_without_delay_is_the_triangle_of_15() -> None:
    """Corners (0, K_o), (3 K_o, 4 K_o), (K_o, 0) and the origin."""
    corners = np.array([(0.0, 1.0), (3.0, 4.0), (1.0, 0.0), (0.0, 0.0), (0.0, 1.0)])
    polygon = stability_area(200.0)
    assert (polygon[0] == polygon[-1]).all()
    assert area(polygon / 200.0) == pytest.approx(area(corners), rel=0.02)


@pytest.mark.parametrize("delay", [0, 7, 25])
def test_inside_is_stable_and_outside_is_not(delay: int) -> None:
    """With fractions of a period of delay too; 10 haptic samples to a period."""
    polygon = stability_area(1.0, rate_ratio=10, delay_samples=delay, points=15)
    upper = polygon[: len(polygon) // 2]
    for k_h, int_ in upper[1:-1]:
        for fraction, stable in ((0.97, True), (1.03, False)):
            local = integral_model(k_h, fraction * int_, 0.1)
            inside = lifted_radius(local, elastic_object(1.0), 10, delay) < 1.0
            assert inside == stable or k_h > 2.5
