from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.bodies.balloon.balloon import BalloonSettings, Inflated, inflate
from cohaptic_server.bodies.balloon.membrane import Membrane
from cohaptic_server.bodies.balloon.rubber_balloon import RubberSheet
from cohaptic_server.cholesky.symbolic import analyse
from cohaptic_server.mesh.enclosed_volume import volume, volume_gradient
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.numeric import Floats
from tests.server.cholesky.block_problem import dense

SETTINGS = BalloonSettings(subdivisions=1)


@pytest.fixture(scope="module")
def inflated() -> Inflated:
    return inflate(SETTINGS)


@pytest.fixture(scope="module")
def sheet(inflated: Inflated) -> RubberSheet:
    x, faces = icosphere(SETTINGS.subdivisions, SETTINGS.radius / SETTINGS.stretch)
    analysis = analyse(faces, x, leaf=8)
    return RubberSheet(Membrane.at_rest(x, faces, SETTINGS.mu_h), np.arange(len(x)), analysis)


def matrix(sheet: RubberSheet, x: Floats, pressure: float) -> Floats:
    """The tangent over (3 n,) in the order of x."""
    return dense(sheet.analysis, sheet.tangent(sheet.strain(x), x, pressure))


def crumpled(x: Floats, by: float) -> Floats:
    return np.asarray(x + np.random.default_rng(3).normal(scale=by, size=x.shape))


def test_at_rest_it_is_the_linear_balloon(sheet: RubberSheet, inflated: Inflated) -> None:
    x, p = inflated.x, inflated.pressure
    K = matrix(sheet, x, p)
    assert np.abs(K - inflated.stiffness.toarray()).max() < 1e-12 * np.abs(K).max()
    net = sheet.force(sheet.strain(x)) - p * sheet.volume_gradient(x)
    assert np.abs(net).max() < 1e-9


@pytest.mark.parametrize("by", [0.001, 0.01, 0.03])
def test_force_and_tangent_are_derivatives(
    sheet: RubberSheet, inflated: Inflated, by: float
) -> None:
    """Also of a crumpled sheet with wrinkles in it (3 cm on a balloon of 10 cm)."""
    x, p, h = crumpled(inflated.x, by), 4000.0, 1e-7
    way = np.random.default_rng(4).normal(size=x.shape)

    def force(x: Floats) -> Floats:
        return np.asarray(sheet.force(sheet.strain(x)) - p * sheet.volume_gradient(x))

    def energy(x: Floats) -> float:
        return sheet.energy(sheet.strain(x)) - p * volume(x, sheet.faces)

    slope = (energy(x + h * way) - energy(x - h * way)) / (2 * h)
    assert float((force(x) * way).sum()) == pytest.approx(slope, rel=1e-5)
    change = (force(x + h * way) - force(x - h * way)) / (2 * h)
    found = matrix(sheet, x, p) @ way.ravel()
    assert np.abs(found - change.ravel()).max() < 1e-4 * np.abs(change).max()
    if by == 0.03:
        c1, c2 = sheet.strain(x)[:, 8:].T
        assert (c1 * c2 * c2 < 1.0).any()


def test_volume_is_a_third_of_gradient_times_position(
    sheet: RubberSheet, inflated: Inflated
) -> None:
    x = crumpled(inflated.x, 0.01)
    g = sheet.volume_gradient(x)
    assert g.ravel() == pytest.approx(volume_gradient(x, sheet.faces), abs=1e-18)
    assert float((g * x).sum()) / 3.0 == pytest.approx(volume(x, sheet.faces), rel=1e-13)
