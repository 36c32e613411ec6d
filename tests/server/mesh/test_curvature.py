from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.mesh.curvature import fit_curvatures, fit_radius
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import locate
from tests.server.fields import bulge

seeds = st.integers(0, 2**32 - 1)
OUT = np.array([0.0, 0.0, 1.0])


def curvature_of(points: Floats, x_free: Floats, normal: Floats, radius: float) -> float:
    """Of the sphere through points of a surface that is not displaced."""
    every = np.arange(len(points))
    still, starts = np.zeros_like(points), np.array([[0, len(points)]] * 2)
    (found,) = fit_curvatures(
        points, starts, every, still, every, x_free[None], normal[None], radius
    )
    return float(found)


def cap(radius: float, rng: np.random.Generator, count: int = 40, width: float = 0.4) -> Floats:
    """Points of a sphere that touches the origin from below; a bowl for a negative radius."""
    angle, round_it = width * np.sqrt(rng.uniform(size=count)), rng.uniform(0, 2 * np.pi, count)
    r = radius * np.sin(angle)
    height = -radius * (1.0 - np.cos(angle))
    return np.column_stack([r * np.cos(round_it), r * np.sin(round_it), height])


@given(seeds, st.floats(0.02, 2.0), st.booleans())
def test_a_sphere_has_its_own_curvature(seed: int, radius: float, bowl: bool) -> None:
    signed = -radius if bowl else radius
    points = cap(signed, np.random.default_rng(seed))
    found = curvature_of(points, np.zeros(3), OUT, 0.5 * radius)
    assert found == pytest.approx(1.0 / signed, rel=1e-6)


@given(seeds, st.tuples(*[st.floats(-0.1, 0.1)] * 2), st.floats(-0.001, 0.001))
def test_neither_height_nor_tilt_passes_for_bending(
    seed: int, tilt: tuple[float, float], lift: float
) -> None:
    flat = np.random.default_rng(seed).uniform(-0.05, 0.05, (60, 3))
    flat[:, 2] = lift + flat[:, :2] @ np.array(tilt)
    assert curvature_of(flat, np.zeros(3), OUT, 0.06) == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize("radius", [0.05, 0.1, 0.4])
def test_a_ball_has_the_curvature_of_its_radius_everywhere(radius: float) -> None:
    mesh = SurfaceMesh(*icosphere(3, radius))
    free = np.zeros_like(mesh.vertices)
    rng = np.random.default_rng(2)
    for _ in range(20):
        d = rng.normal(size=3)
        d /= np.linalg.norm(d)
        contact = locate(mesh, 0.95 * radius * d, free, radius=0.2 * radius)
        at = contact.moved(free)
        c = curvature_of(mesh.vertices + free, at, contact.normal, fit_radius(mesh, 0.2 * radius))
        assert c == pytest.approx(1.0 / radius, rel=0.02)


def test_a_pressed_balloon_is_flatter_under_the_hand_and_elsewhere_as_it_was(
    balloon: Balloon,
) -> None:
    """Curvature of the surface as it stands: what a second hand finds there."""
    at_rest = np.zeros_like(balloon.mesh.vertices)
    push = locate(balloon.mesh, np.array([0.09, 0.0, 0.0]), at_rest, radius=0.02)
    pressed = balloon.respond([push.load(8.0)]).displacement

    def curvature(angle: float, displacement: Floats) -> float:
        probe = 0.08 * np.array([np.cos(angle), np.sin(angle), 0.0])
        contact = locate(balloon.mesh, probe, displacement, radius=0.02)
        at = contact.moved(displacement)
        points = balloon.mesh.vertices + displacement
        return curvature_of(points, at, contact.normal, fit_radius(balloon.mesh, 0.02))

    assert curvature(0.0, at_rest) == pytest.approx(10.0, rel=0.03)
    assert curvature(0.0, pressed) < 6.0
    assert curvature(0.0, pressed) < curvature(0.2, pressed) < curvature(0.4, pressed) < 9.5
    for angle in (0.8, 1.6, 2.4, np.pi):
        assert curvature(angle, pressed) == pytest.approx(10.0, rel=0.05)


@given(seeds, st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(0.0, np.pi))
def test_a_displacement_bulges_a_plane_by_its_largest_curvature(
    seed: int, one: float, other: float, turn: float
) -> None:
    """Whatever height and tilt it has beside, and wherever the plane lies in space."""
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    axes[:, 2] *= np.linalg.det(axes)
    u, v = (a.ravel() for a in np.meshgrid(*[np.linspace(-0.03, 0.03, 13)] * 2))
    flat = np.column_stack([u, v, np.zeros_like(u)]) @ axes.T
    squares = np.arange(12)[:, None] * 13 + np.arange(12)
    a, b, c, d = (squares.ravel() + k for k in (0, 1, 14, 13))
    mesh = SurfaceMesh(flat, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))
    p, q = u * np.cos(turn) + v * np.sin(turn), v * np.cos(turn) - u * np.sin(turn)
    height = 0.02 + 0.3 * u - 0.1 * v - 0.5 * (one * p * p + other * q * q)
    moved = height[:, None] * axes[:, 2] + rng.normal(size=2) @ axes[:, :2].T
    frame = np.array([flat[84], flat[84], axes[:, 2]])
    found = bulge(mesh, np.arange(len(flat)), moved, frame, 0.01)
    assert found == pytest.approx(max(one, other), abs=1e-4)
