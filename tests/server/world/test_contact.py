from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.world.contact import Contact, locate, turned
from cohaptic_server.world.displacement_field import ZeroField
from tests.examples_of_laws import examples

RADIUS = 0.1  # m, of the balloon
units = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)).filter(
    lambda v: np.linalg.norm(v) > 0.3
)


def test_contact_and_normal_glide_when_a_deep_probe_slides(balloon: Balloon) -> None:
    """Nearest points of a faceted surface would jump by millimetres from inside; these must not."""
    free = np.zeros_like(balloon.mesh.vertices)
    angles = np.linspace(0.0, 0.6, 601)  # 0.1 mm of surface each
    contact: Contact | None = None
    points, normals = list[np.ndarray](), list[np.ndarray]()
    for angle in angles:
        probe = 0.08 * np.array([np.cos(angle), np.sin(angle), 0.1])
        contact = locate(balloon.mesh, probe, free, radius=0.02, hint=contact)
        points.append(contact.point)
        normals.append(contact.normal)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() < 0.0002
    assert np.linalg.norm(np.diff(normals, axis=0), axis=1).max() < 0.003


@given(units)
@settings(max_examples=examples(30), deadline=None)
def test_a_hint_speeds_up_and_changes_nothing(
    balloon: Balloon, direction: tuple[float, float, float]
) -> None:
    body = balloon
    d = np.array(direction) / np.linalg.norm(direction)
    free = body.respond(
        [locate(body.mesh, np.array([0.1, 0, 0]), np.zeros((642, 3)), radius=0.02).load(3.0)]
    ).displacement
    cold = locate(body.mesh, 0.095 * d, free, radius=0.02)
    tilted = d + np.array([0.1, 0.05, 0.0])
    near = locate(body.mesh, 0.095 * tilted / np.linalg.norm(tilted), free, radius=0.02)
    warm = locate(body.mesh, 0.095 * d, free, radius=0.02, hint=near)
    assert warm.point == pytest.approx(cold.point, abs=6e-5)  # each within 30 um
    assert warm.normal == pytest.approx(cold.normal, abs=1e-3)


@given(units, st.floats(0.0, 0.01), st.booleans())
@settings(max_examples=examples(30), deadline=None)
def test_a_contact_can_be_found_exactly(
    balloon: Balloon, direction: tuple[float, float, float], depth: float, hinted: bool
) -> None:
    """The probe lies on its normal, on a surface that somebody else has dented; with a hint, too,
    next to which a tick would have let it stay.
    """
    mesh, d = balloon.mesh, np.array(direction) / np.linalg.norm(direction)
    other = locate(mesh, np.array([0.1, 0.0, 0.0]), ZeroField(), radius=0.02)
    free = balloon.respond([other.load(3.0)]).displacement
    probe, hint = (0.1 - depth) * d, None
    if hinted:
        beside = probe + 4e-5 * np.cross(d, [0.3, 0.5, 0.8])
        hint = locate(mesh, beside, free, radius=0.02, tolerance=1e-6)
    contact = locate(mesh, probe, free, radius=0.02, hint=hint, tolerance=1e-6)
    off = probe - contact.moved(free)
    assert np.abs(off - (off @ contact.normal) * contact.normal).max() < 1e-6
    usual = locate(mesh, probe, free, radius=0.02, hint=hint)
    assert contact.point == pytest.approx(usual.point, abs=1e-4)


def test_a_deep_probe_behind_an_edge_is_followed_as_closely_as_any() -> None:
    """Where the normal turns nearly as fast as the contact slides, being hardly beside the normal
    would be ten times as far off along the surface: forces a twentieth off, on a block.
    """
    vertices, faces = icosphere(4, RADIUS)
    rim = SurfaceMesh(vertices * [1.0, 1.0, 0.3], faces)  # 9 mm round
    for depth, beside in itertools.product((0.002, 0.004, 0.006, 0.008), (0.0, 0.002, 0.004)):
        contact: Contact | None = None
        probe = np.array([RADIUS - depth, 0.0, 0.0])
        for k in range(200):  # it comes to rest, in ever smaller steps
            probe[2] = beside + 0.01 * math.exp(-k / 20)
            contact = locate(rim, probe, ZeroField(), radius=0.01, hint=contact)
        assert contact is not None
        exact = locate(rim, probe, ZeroField(), radius=0.01, tolerance=1e-8)
        # 60 um are what a contact may stay beside its place.
        assert np.linalg.norm(contact.point - exact.point) < 8e-5


def test_a_contact_may_be_seen_on_another_surface(small_balloon: Balloon) -> None:
    """Its place stays, and its normal is that of the displaced surface: a rigid turn turns it."""
    mesh = small_balloon.mesh
    contact = locate(mesh, np.array([0.1, 0.0, 0.02]), ZeroField(), radius=0.03)
    angle = 0.3
    turn = np.array(
        [
            [np.cos(angle), -np.sin(angle), 0.0],
            [np.sin(angle), np.cos(angle), 0.0],
            [0.0, 0.0, 1.0],
        ]
    )
    seen = turned(mesh, contact, mesh.vertices @ turn.T - mesh.vertices)
    assert seen.normal == pytest.approx(turn @ contact.normal)
    assert seen.vertices is contact.vertices
    assert seen.weights is contact.weights


@pytest.mark.parametrize("depth", [5e-4, 1e-3, 2e-3])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_contact_of_a_shallow_press_is_as_near_as_its_depth_asks(
    balloon: Balloon, depth: float, seed: int
) -> None:
    """On a crumpled surface an offset along it is one of the depth, too; 60 um are 6 % of 1 mm."""
    rng = np.random.default_rng(seed)
    mesh, radius = balloon.mesh, balloon.contact_radius
    free = rng.uniform(-0.003, 0.003, mesh.vertices.shape)
    out = np.array([1.0, 0.0, 0.0])
    far = locate(mesh, 0.1 * out, free, radius=radius, tolerance=1e-7)
    tip = far.moved(free) - depth * far.normal
    hint = locate(mesh, tip, free, radius=radius)
    for _ in range(20):
        tip = tip + rng.normal(size=3) * 2e-5  # a hand that trembles
        hint = locate(mesh, tip, free, radius=radius, hint=hint)
        exact = locate(mesh, tip, free, radius=radius, hint=hint, tolerance=1e-7)
        there, sought = (float(c.normal @ (c.moved(free) - tip)) for c in (hint, exact))
        assert there == pytest.approx(sought, abs=0.001 * depth)
