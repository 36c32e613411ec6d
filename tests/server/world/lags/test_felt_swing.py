from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.delay import LoopDelay
from cohaptic.control.law import Law
from cohaptic.control.stability.anticipation import UNCOUPLED, Gains
from cohaptic_server.bodies.modal.modal_body import ModalResponse
from cohaptic_server.world.lags.felt_swing import show_swing
from cohaptic_server.world.users import Hand
from tests.examples_of_laws import examples
from tests.server.bodies.modal.jelly import DT, jelly, solid
from tests.server.bodies.presses import press
from tests.server.touches import touch

WAYS = [(1.0, 0.0, 0.8), (-1.0, 0.2, 0.5), (0.0, 1.0, 0.2)]
SPANS = [slice(0, 1), slice(1, 2), slice(2, 3)]


def hands_of(budget: float = 8.0) -> tuple[list[Hand], ModalResponse]:
    response = jelly().respond([press(solid(), way, 0.02) for way in WAYS])
    users = [
        Hand(touch(i + 1, max_stiffness=2000.0, damping_budget=budget), LoopDelay())
        for i in range(len(WAYS))
    ]
    return users, response


def shown(
    near: list[float],
    before: float,
    gains: Gains | None = UNCOUPLED,
    budget: float = 8.0,
) -> float:
    """The share after one tick."""
    users, response = hands_of(budget)
    found = show_swing(
        jelly(),
        response.showing(before),
        users,
        near,
        gains,
        0.0,
        compliance=response.compliance,
        spans=SPANS,
        starts=[0, 1, 2, 3],
        dt=DT,
    )
    assert isinstance(found, ModalResponse)
    return found.felt


@given(st.floats(0.0, 1.0), st.lists(st.sampled_from([0.0, 0.4, 1.0]), min_size=3, max_size=3))
@settings(max_examples=examples(30), deadline=None)
def test_it_rises_slowly_and_falls_fast(before: float, near: list[float]) -> None:
    after = shown(near, before)
    assert 0.0 <= after <= 1.0
    assert before - 10.0 * DT - 1e-12 <= after <= before + DT + 1e-12
    if not any(near):  # nobody closes a loop: all of it may be shown
        assert after == pytest.approx(min(1.0, before + DT))


def test_less_is_shown_to_more_hands_and_to_devices_that_damp_less() -> None:
    def steady(near: list[float], budget: float = 8.0) -> float:
        fraction = 0.0
        for _ in range(120):
            fraction = shown(near, fraction, budget=budget)
        return fraction

    one, two, three = steady([1.0, 0.0, 0.0]), steady([1.0, 1.0, 0.0]), steady([1.0, 1.0, 1.0])
    assert one > two > three > 0.0
    assert 0.0 < steady([1.0, 0.0, 0.0], budget=0.0) < one


def test_none_is_shown_to_a_hand_alone_that_answers_its_own_dent() -> None:
    """Nobody else couples with it, so that it has gains like any other hand."""
    response = jelly().respond([press(solid(), WAYS[0], 0.02)])
    C, span = response.compliance, [slice(0, 1)]
    for law, expected in ((Law.PREDICTIVE, 0.05), (Law.PROPORTIONAL, 0.0), (Law.PI, 0.0)):
        users = [Hand(touch(1, law=law), LoopDelay())]
        found = show_swing(
            jelly(), response.showing(0.05), users, [1.0], UNCOUPLED, 0.0, C, span, [0, 1], DT
        )
        assert isinstance(found, ModalResponse)
        assert found.felt >= expected if expected else found.felt == 0.0


def test_a_hand_with_friction_counts_in_three_directions() -> None:
    """Its response has three loads; K along the surface adds to what the swing takes."""
    load = press(solid(), WAYS[0], 0.02)
    n = load.direction
    along = np.cross(n, (0.0, 0.0, 1.0))
    along /= np.linalg.norm(along)
    loads = [load, *(replace(load, direction=d, force=0.0) for d in (along, np.cross(n, along)))]
    response = jelly().respond(loads)
    fractions: list[float] = []
    for friction, span in ((False, slice(0, 1)), (True, slice(0, 3))):
        user = Hand(
            touch(1, max_stiffness=2000.0, damping_budget=8.0, friction=friction), LoopDelay()
        )
        C = response.compliance[span, span]
        fraction: float = 0.0
        for _ in range(120):
            found = show_swing(
                jelly(),
                response.showing(fraction),
                [user],
                [1.0],
                UNCOUPLED,
                0.0,
                C,
                [span],
                [0, 3],
                DT,
            )
            assert isinstance(found, ModalResponse)
            fraction = found.felt
        fractions.append(fraction)
    assert fractions[1] < fractions[0]
