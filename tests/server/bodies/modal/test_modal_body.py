from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.bodies.modal.modal_body import ModalResponse
from cohaptic_server.testing import check_body
from tests.examples_of_laws import examples
from tests.server.bodies.modal.jelly import DT, jelly, modes, solid
from tests.server.bodies.presses import press

SIDE = (1.0, 0.0, 0.8)  # of the top, from the middle


def swayed(response: ModalResponse) -> float:
    """How far the top is off, sideways [m]."""
    top = solid().mesh.vertices[:, 2] >= 0.12
    return float(response.displacement[top, 0].mean())


@pytest.mark.parametrize(("damping", "dt"), [(0.5, 0.05), (0.5, DT)])
def test_it_keeps_the_laws_of_an_elastic_body(damping: float, dt: float) -> None:
    """With a long tick too: the energy, kinetic and elastic, is paid for.

    Less damped it breaks one of them: a hand behind a delay that is shown all of the swing does not
    come to rest, which is why hands are shown a share (science 3.14)."""
    check_body(jelly(damping, dt))


def test_let_go_it_swings_at_its_natural_frequency_and_rests() -> None:
    body = jelly()
    held = body.respond([press(solid(), SIDE, 0.05)])
    response, places = held, list[float]()
    for _ in range(600):
        response = body.respond([], response)
        places.append(swayed(response))
    start, path = swayed(held), np.array(places)
    assert abs(start) > 1e-3
    assert path.min() < -0.3 * start if start > 0.0 else path.max() > -0.3 * start
    rises = np.flatnonzero((path[:-1] < 0.0) & (path[1:] >= 0.0))
    period = float(np.diff(rises)[:3].mean()) * DT
    w = float(modes().frequency[0])
    assert period == pytest.approx(2.0 * np.pi / (w * np.sqrt(1.0 - 0.1**2)), rel=0.03)
    assert abs(path[-60:]).max() < 1e-2 * abs(start)


def test_hands_are_shown_a_share_of_the_swing_and_everybody_sees_all_of_it() -> None:
    body, load = jelly(), press(solid(), SIDE, 0.05)
    some = np.arange(0, len(solid().mesh.vertices), 7)
    before = body.respond([load]).showing(0.25)
    after = body.respond([], before)
    swing = after.displacement_of(some)  # nothing presses any more
    assert np.abs(swing).max() > 1e-3
    nothing = np.zeros(0)
    assert after.without(slice(0, 0), nothing, some) == pytest.approx(0.25 * swing)
    assert after.displacement[some] == pytest.approx(swing)
    unfelt = body.respond([], before.showing(0.0))
    assert unfelt.without(slice(0, 0), nothing, some) == pytest.approx(0.0 * swing)


@given(st.lists(st.floats(-0.05, 0.05), min_size=2, max_size=12), st.floats(0.02, 0.9))
@settings(max_examples=examples(20), deadline=None)
def test_two_halves_of_a_force_are_the_force(forces: list[float], damping: float) -> None:
    body = jelly(damping)
    whole, halves = body.respond([]), body.respond([])
    for force in forces:
        whole = body.respond([press(solid(), SIDE, force)], whole)
        halves = body.respond([press(solid(), SIDE, 0.5 * force)] * 2, halves)
    assert halves.displacement == pytest.approx(whole.displacement, abs=1e-9)
    assert halves.energy == pytest.approx(whole.energy, rel=1e-6, abs=1e-12)
