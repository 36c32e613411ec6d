from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.touched_body import vertex_compliance
from cohaptic_server.objects.auto.softness import fitting_young
from cohaptic_server.testing.blocks import block
from cohaptic_tools.demo.felt import RENDERED
from cohaptic_tools.demo.places import place_hands
from cohaptic_tools.demo.scene import PRESS_DEPTH, Scene, reference
from cohaptic_tools.demo.settled import Placement


@pytest.fixture(scope="module")
def tower() -> Solid:
    tets = block((0.06, 0.06, 0.14), (6, 6, 12))
    settings = SolidSettings(order=1, contact_radius=0.012)
    return Solid(tets, tets.vertices[:, 2] <= 0.0, settings)


@pytest.fixture(scope="module")
def standing(tower: Solid) -> Placement:
    return place_hands(tower, held(tower), 2)


def held(solid: Solid) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return solid.shape.fixed[solid.shape.surface]


def test_hands_stand_on_the_surface_and_press_into_it(tower: Solid, standing: Placement) -> None:
    x, n = tower.mesh.vertices, tower.mesh.normals
    for place in standing.places:
        vertex = int(np.linalg.norm(x - np.array(place.point), axis=1).argmin())
        assert x[vertex] == pytest.approx(np.array(place.point))
        assert -n[vertex] == pytest.approx(np.array(place.inward))
        assert place.point[2] > 0.02  # off the foot, which is held
    assert standing.distances[0] == 0.0
    assert standing.distances[1] >= 0.03
    assert 0.004 < standing.depth <= PRESS_DEPTH


def test_a_flat_object_that_lies_on_what_holds_it_has_places_on_its_other_side() -> None:
    """Less than two contact radii from what is held, all of it."""
    tets = block((0.12, 0.12, 0.02), (8, 8, 2))
    settings = SolidSettings(order=1, contact_radius=0.0128)
    flat = Solid(tets, tets.vertices[:, 2] <= 0.0, settings)
    placement = place_hands(flat, held(flat), 2)
    assert all(place.point[2] == pytest.approx(0.02) for place in placement.places)


def test_everybody_feels_the_press(tower: Solid, standing: Placement) -> None:
    """At least a twentieth of its own: more than the hand's least difference."""
    scene = Scene(2, places=standing.places, depth=standing.depth)
    pressed = reference(scene, tower, pressed=True)
    released = reference(scene, tower, pressed=False)
    assert released.force[0] == pytest.approx(0.0)
    assert abs(pressed.force[1] - released.force[1]) > 0.05 * pressed.force[1]
    assert (np.abs(pressed.felt_from_others) > 0.05 * pressed.force).all()


def hardened(solid: Solid) -> Solid:
    young = fitting_young(solid, solid.settings.young)
    settings = replace(solid.settings, young=young)
    tets = solid.shape.tets
    return Solid(tets, solid.shape.fixed[: len(tets.vertices)], settings)


def test_no_hand_stands_where_it_is_stiffer_than_a_device() -> None:
    """On a tower that is stiffer than that near its foot, and softer at its top."""
    tets = block((0.04, 0.04, 0.14), (4, 4, 12))
    settings = SolidSettings(2e5, order=1, contact_radius=0.012)
    tall = Solid(tets, tets.vertices[:, 2] <= 0.0, settings)
    table = vertex_compliance(tall)
    free = table[table > 0.0]
    assert free.min() < 1.0 / RENDERED < np.median(free)
    for place in place_hands(tall, held(tall), 2).places:
        vertex = int(np.linalg.norm(tall.mesh.vertices - np.array(place.point), axis=1).argmin())
        assert table[vertex] >= 1.0 / RENDERED


def test_a_slab_on_what_holds_it_has_no_places_and_that_is_known() -> None:
    tets = block((0.12, 0.12, 0.01), (10, 10, 1))
    settings = SolidSettings(order=1, contact_radius=0.0128)
    slab = hardened(Solid(tets, tets.vertices[:, 2] <= 0.0, settings))
    assert not place_hands(slab, held(slab), 2).pair.is_felt


# Sixteen have no room with three contact radii between each two, and find it with fewer.
@pytest.mark.parametrize("users", [5, 16])
def test_more_hands_keep_apart(tower: Solid, users: int) -> None:
    x = np.array([place.point for place in place_hands(tower, held(tower), users).places])
    gaps = np.linalg.norm(x[:, None] - x[None], axis=2) + np.eye(users)
    assert gaps.min() >= 0.03


def test_there_is_an_end_to_the_room(tower: Solid) -> None:
    with pytest.raises(BodyError, match=r"no (room|place) for 60 hands"):
        place_hands(tower, held(tower), 60)
    every = np.ones(len(tower.mesh.vertices), dtype=np.bool_)
    with pytest.raises(BodyError, match=r"no place for 2 hands: 0 of .*Hold less of it"):
        place_hands(tower, every, 2)
