from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.newton import FiniteResponse
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.blocks import block
from cohaptic_server.testing.check_body import settled
from tests.examples_of_laws import examples
from tests.server.bodies.presses import press

directions = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0, 1)).filter(
    lambda v: np.linalg.norm(v) > 0.3
)
forces = st.floats(0.1, 2.0)


@functools.cache
def body() -> RubberSolid:
    mesh = block((0.1, 0.08, 0.06), (3, 3, 2))
    return RubberSolid(mesh, mesh.vertices[:, 2] < 0.005, SolidSettings(2e4, 0.45, 0.015))


def pressed(loads: Sequence[Load]) -> FiniteResponse:
    return settled(body(), loads, None)


def free_of(response: FiniteResponse, i: int) -> tuple[Floats, Floats]:
    """The surface free of load i, as shown and by the tangent alone, shape (n, 3) [m]."""
    every, force = np.arange(len(body().mesh.vertices)), response.loads[i].force
    shown = response.without(slice(i, i + 1), np.array([force]), every)
    return shown, response.displacement - force * response.fields[i]


@given(directions, forces)
@settings(max_examples=examples(15))
def test_who_is_alone_has_the_resting_surface_moved_along_the_force(
    direction: tuple[float, float, float], force: float
) -> None:
    load = press(body(), direction, force)
    shown, _ = free_of(pressed([load]), 0)
    assert shown == pytest.approx(np.tile(shown[0], (len(shown), 1)), abs=1e-6)
    assert np.cross(shown[0], load.direction) == pytest.approx(np.zeros(3), abs=1e-6)


@given(st.lists(st.tuples(directions, forces), min_size=2, max_size=3))
@settings(max_examples=examples(15), deadline=None)
def test_along_the_force_it_is_the_step_of_newtons_method(
    hands: list[tuple[tuple[float, float, float], float]],
) -> None:
    """Whoever else presses, so that depth and compliance of a patch belong together."""
    loads = [press(body(), *hand) for hand in hands]
    response = pressed(loads)
    for i, load in enumerate(loads):
        shown, tangent = free_of(response, i)
        along = [load.weights @ (free[load.vertices] @ load.direction) for free in (shown, tangent)]
        assert along[0] == pytest.approx(along[1], abs=1e-12)


def test_what_others_do_is_theirs() -> None:
    """Far from a dent of its own, a hand is shown what rubber really does under the others."""
    near, far = press(body(), (1.0, 0.0, 0.3), 0.05), press(body(), (-1.0, 0.0, 0.3), 3.0)
    response = pressed([near, far])
    shown, _ = free_of(response, 0)
    alone = pressed([far]).displacement
    under = far.vertices
    moved = np.abs(alone[under]).max()
    assert np.abs(shown[under] - alone[under]).max() < 0.05 * moved
