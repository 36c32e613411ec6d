"""Hands of a demonstration press no deeper than they come to rest."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.testing.blocks import block
from cohaptic_server.world.equilibrium import Equilibrium
from cohaptic_tools.demo import settled
from cohaptic_tools.demo.felt import PairForces
from cohaptic_tools.demo.places import placements
from cohaptic_tools.demo.scene import Scene, reference
from cohaptic_tools.demo.settled import Placement, at_rest, first_that_rests, rests

pytestmark = pytest.mark.usefixtures("kernels")


@pytest.fixture(scope="module")
def rubber() -> RubberSolid:
    mesh = block((0.05, 0.05, 0.1), (3, 3, 5))
    return RubberSolid(mesh, mesh.vertices[:, 2] < 1e-9, SolidSettings(2e4, 0.45, 0.01))


@pytest.fixture(scope="module")
def standing(rubber: RubberSolid) -> list[Placement]:
    return placements(rubber, rubber.shape.fixed[rubber.shape.surface], 2)


def test_the_forces_at_rest_are_those_of_the_equilibrium(
    rubber: RubberSolid, standing: list[Placement]
) -> None:
    found = at_rest(rubber, replace(standing[0], depth=0.002))
    assert found is not None
    expected = reference(Scene(2, places=found.places, depth=0.002), rubber, pressed=True)
    assert found.pair.force == pytest.approx(expected.force)
    assert found.pair.felt == pytest.approx(np.abs(expected.felt_from_others))


def test_hands_that_are_wedged_far_from_their_places_do_not_rest(
    rubber: RubberSolid, standing: list[Placement], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A soft limb has such equilibria beside those that a press finds; tips hardly move there."""
    placement = replace(standing[0], depth=0.002)
    real = reference
    for fraction, resting in ((1.0, True), (30.0, False)):

        def wedged(*args: Any, fraction: float = fraction, **more: Any) -> Equilibrium:
            found = real(*args, **more)
            own = np.diag(np.diag(found.compliance))
            return replace(found, compliance=own + fraction * (found.compliance - own))

        monkeypatch.setattr(settled, "reference", wedged)
        assert rests(rubber, placement) == resting


def test_a_contact_that_becomes_stiffer_than_a_device_does_not_rest(
    rubber: RubberSolid, standing: list[Placement], monkeypatch: pytest.MonkeyPatch
) -> None:
    placement, real = replace(standing[0], depth=0.002), reference
    for hardened, resting in ((1.0, True), (100.0, False)):

        def harder(*args: Any, hardened: float = hardened, **more: Any) -> Equilibrium:
            found = real(*args, **more)
            return replace(found, compliance=found.compliance / hardened)

        monkeypatch.setattr(settled, "reference", harder)
        assert rests(rubber, placement) == resting


def test_hands_press_as_deep_as_they_rest(rubber: RubberSolid, standing: list[Placement]) -> None:
    deep = [replace(placement, depth=0.06) for placement in standing]
    fractions: list[float] = []
    found = first_that_rests(rubber, deep, fractions.append)
    assert rests(rubber, found)
    assert 0.0 < found.depth < 0.06
    assert fractions == sorted(fractions)
    assert fractions[0] == 0.0
    assert fractions[-1] < 1.0


class Answers:
    """Replaces `at_rest`: each placement has the pair of its forces at a depth, in a table.

    Args:
        pairs: Forces by the first hand's place and depth; nothing where the hands do not rest.
    """

    def __init__(self, pairs: dict[tuple[int, float], PairForces]) -> None:
        self.pairs = pairs
        self.asked: list[tuple[int, float]] = []

    def __call__(self, body: Body, placement: Placement) -> Placement | None:
        del body
        key = int(placement.distances[0]), round(placement.depth, 4)
        self.asked.append(key)
        return replace(placement, pair=self.pairs[key]) if key in self.pairs else None


def forces(press: float, felt: float) -> PairForces:
    return PairForces(np.array([press, press]), np.array([felt, felt]))


def chosen(
    answers: Answers, standing: list[Placement], monkeypatch: pytest.MonkeyPatch
) -> tuple[int, float]:
    """Number and depth of the placement that is taken of three that are 10 mm deep."""
    monkeypatch.setattr(settled, "at_rest", answers)
    three = [replace(standing[0], depth=0.01, distances=(float(i), 1.0)) for i in range(3)]
    body: Any = None
    found = first_that_rests(body, three, lambda fraction: None)
    return int(found.distances[0]), round(found.depth, 4)


def test_where_none_is_felt_the_one_that_is_felt_most_is_taken(
    standing: list[Placement], monkeypatch: pytest.MonkeyPatch
) -> None:
    weak = {(0, 0.01): forces(1.0, 0.05), (1, 0.007): forces(1.0, 0.19), (2, 0.01): forces(0.1, 9)}
    answers = Answers(weak)
    assert chosen(answers, standing, monkeypatch) == (1, 0.007)
    # Less deep it would be felt even less.
    assert answers.asked.count((0, 0.005)) == answers.asked.count((2, 0.0012)) == 0
    assert answers.asked.count((1, 0.007)) == 1
