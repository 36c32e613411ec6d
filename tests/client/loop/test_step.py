from __future__ import annotations

import copy

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.laws.model import NO_FORCE
from cohaptic.protocol.patch import Patch
from cohaptic.vec import ZERO
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.arrival import (
    receive,
)
from cohaptic_client.loop.ledger import Ledger, ledger_of
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.state import LoopSettings, LoopState
from tests.client.loop.loop_cases import (
    SETTINGS,
    WIDE,
    at,
    engaged,
    near_patches,
    play,
    samples,
    shown_at,
)
from tests.client.plane import PLANE


@given(near_patches, st.lists(samples, min_size=1, max_size=5), st.sampled_from(WIDE))
def test_the_same_inputs_give_the_same_outputs_and_the_state_stays_as_it_was(
    patch: Patch, samples: list[DeviceSample], settings: LoopSettings
) -> None:
    state = engaged(patch, settings)
    kept = copy.deepcopy(state)
    one, first = play(state, samples, settings, 10.0)
    two, second = play(state, samples, settings, 10.0)
    assert two == one
    assert [results(period) for period in second] == [results(period) for period in first]
    assert state == kept


def results(period: Period) -> tuple[object, ...]:
    """What a period gives hand, server and recording."""
    return (
        period.force, period.on_body, period.anchor, period.local, period.damping_force,
        period.u_others, period.silent, period.deflection,
    )  # fmt: skip


def test_before_the_first_patch_there_is_no_force_and_the_server_counts_as_silent() -> None:
    state, outputs = play(LoopState(), [at((0.0, 0.0, -0.05))] * 100, SETTINGS, 10.0)
    for output in outputs:
        assert (output.force, output.on_body, output.anchor) == (ZERO, ZERO, None)
        assert (output.local, output.damping_force, output.u_others) == (NO_FORCE, 0.0, 0.0)
        assert output.silent
        assert output.deflection is None
        assert ledger_of(output, 10.0) == Ledger()
    assert shown_at(state, ZERO, 10.0, SETTINGS) is None


def test_a_hand_that_was_inside_from_the_start_gets_no_force() -> None:
    state = receive(LoopState(), PLANE, 10.0, SETTINGS)
    _, outputs = play(state, [at((0.0, 0.0, -0.01))] * 90, SETTINGS, 10.0)
    assert {output.force for output in outputs} == {ZERO}
    assert outputs[-1].local.normal_force == pytest.approx(2.5)
