from __future__ import annotations

import numpy as np

from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.testing.blocks import block
from cohaptic_server.world.contact import locate
from cohaptic_server.world.displacement_field import ZeroField
from cohaptic_tools.demo.places import is_met_squarely, place_hands


def test_no_hand_stands_on_a_rim_where_it_would_slide_to_the_face_beside_it() -> None:
    """There a finger that comes from the side presses nothing."""
    tets = block((0.12, 0.12, 0.006), (12, 12, 2))
    settings = SolidSettings(order=1, contact_radius=0.012)
    sheet = Solid(tets, tets.vertices[:, 0] <= 0.0, settings)
    x, n = sheet.mesh.vertices, sheet.mesh.normals
    away = x[:, 0] > 0.03
    on_face = np.flatnonzero((np.abs(n[:, 2]) > 0.99) & away)
    on_rim = np.flatnonzero((np.abs(n[:, 2]) < 0.1) & away)
    assert is_met_squarely(sheet, on_face).all()
    missed = on_rim[~is_met_squarely(sheet, on_rim)]
    assert len(missed) > 3
    places = place_hands(sheet, sheet.shape.fixed[sheet.shape.surface], 2).places
    for place in places:
        assert np.linalg.norm(x[missed] - np.array(place.point), axis=1).min() > 1e-3
    for k in missed.tolist():
        tip = x[k] - 0.0006 * n[k]
        found = [
            locate(sheet.mesh, tip + way, ZeroField(), radius=0.012).normal
            for way in 0.0012 * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
        ]
        assert min(float(normal @ n[k]) for normal in found) < 0.9


def test_the_side_of_a_block_is_met() -> None:
    tets = block((0.06, 0.06, 0.14), (6, 6, 12))
    tower = Solid(tets, tets.vertices[:, 2] <= 0.0, SolidSettings(order=1, contact_radius=0.012))
    x, n = tower.mesh.vertices, tower.mesh.normals
    inner = np.flatnonzero((np.abs(n).max(axis=1) > 0.99) & (np.abs(x[:, 2] - 0.07) < 0.04))
    assert is_met_squarely(tower, inner).all()
