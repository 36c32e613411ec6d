"""Hands of a demonstration press no deeper than they come to rest."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.testing.blocks import block
from cohaptic_server.world.equilibrium import Equilibrium
from cohaptic_tools.demo import settled
from cohaptic_tools.demo.lateness import LEAST
from cohaptic_tools.demo.places import placements
from cohaptic_tools.demo.scene import Scene, reference
from cohaptic_tools.demo.settled import Placement, first_that_rests, force_at_rest, rests

pytestmark = pytest.mark.usefixtures("kernels")


@pytest.fixture(scope="module")
def rubber() -> RubberSolid:
    mesh = block((0.05, 0.05, 0.1), (3, 3, 5))
    return RubberSolid(mesh, mesh.vertices[:, 2] < 1e-9, SolidSettings(2e4, 0.45, 0.01))


@pytest.fixture(scope="module")
def standing(rubber: RubberSolid) -> list[Placement]:
    return placements(rubber, rubber.shape.fixed[rubber.shape.surface], 2)


def test_a_shallow_press_rests_and_one_through_the_half_of_the_body_does_not(
    rubber: RubberSolid, standing: list[Placement]
) -> None:
    assert rests(rubber, replace(standing[0], depth=0.002))
    assert not rests(rubber, replace(standing[0], depth=0.16))


def test_hands_that_are_wedged_far_from_their_places_do_not_rest(
    rubber: RubberSolid, standing: list[Placement], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A soft limb has such equilibria beside those that a press finds; tips hardly move there."""
    placement = replace(standing[0], depth=0.002)
    real = reference
    for share, at_rest in ((1.0, True), (30.0, False)):

        def wedged(*args: Any, share: float = share, **more: Any) -> Equilibrium:
            found = real(*args, **more)
            own = np.diag(np.diag(found.compliance))
            return replace(found, compliance=own + share * (found.compliance - own))

        monkeypatch.setattr(settled, "reference", wedged)
        assert rests(rubber, placement) == at_rest


@pytest.mark.slow
def test_hands_press_as_deep_as_they_rest(rubber: RubberSolid, standing: list[Placement]) -> None:
    deep = [replace(placement, depth=0.06) for placement in standing]
    shares: list[float] = []
    found = first_that_rests(rubber, deep, shares.append)
    assert rests(rubber, found)
    assert 0.0 < found.depth < 0.06
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert shares[-1] < 1.0


def test_a_contact_that_came_through_to_the_far_side_does_not_rest(
    rubber: RubberSolid, standing: list[Placement]
) -> None:
    """It presses there by 0.6 N, and its tip is where it wants to be."""
    deep = replace(standing[0], depth=0.04)
    found = reference(Scene(2, places=deep.places, depth=0.04), rubber, pressed=True)
    assert np.linalg.norm(found.place[0] - deep.places[0].point) > 0.04
    assert found.force[0] > 0.5
    assert not rests(rubber, deep)


@pytest.mark.slow
def test_the_best_of_those_that_rest_is_taken(
    rubber: RubberSolid, standing: list[Placement]
) -> None:
    shallow = [replace(placement, depth=0.002) for placement in standing]
    assert first_that_rests(rubber, shallow, print).places == shallow[0].places
    found = first_that_rests(rubber, [replace(shallow[0], depth=0.16), *shallow[1:]], print)
    assert found.depth == pytest.approx(0.002)
    assert np.linalg.norm(np.array(found.places[0].point) - shallow[1].places[0].point) < 1e-9


def test_where_the_best_is_not_felt_another_is_taken(
    rubber: RubberSolid, standing: list[Placement]
) -> None:
    shallow = [replace(placement, depth=2e-5) for placement in standing[:3]]
    shallow.sort(key=lambda placement: force_at_rest(rubber, placement) or 0.0)
    forces = [force_at_rest(rubber, placement) or 0.0 for placement in shallow]
    assert 0.0 < forces[0] < LEAST < forces[1]
    assert first_that_rests(rubber, shallow, print).places == shallow[1].places


@pytest.mark.slow
def test_where_they_rest_nowhere_the_press_is_shallow(
    rubber: RubberSolid, standing: list[Placement]
) -> None:
    hopeless = replace(standing[0], depth=0.2)
    assert first_that_rests(rubber, [hopeless], print).depth < 0.1
