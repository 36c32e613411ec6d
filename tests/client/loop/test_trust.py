"""The account of the energy that a contact returns to the hand, and the trust in models."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.hand_model import USUAL_HAND
from cohaptic.protocol.partners import Partners
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.state import LoopState
from cohaptic_client.loop.step import step
from cohaptic_client.loop.trust import ALLOWED, FULL_TRUST, MAX_MADE, Trust, beyond, trusted
from tests.client.loop.loop_cases import SETTINGS, at
from tests.client.plane import PLANE

DT = 0.001  # s
periods = st.lists(
    st.tuples(
        st.floats(-10.0, 10.0),
        st.floats(-2e-3, 2e-3),
        st.sampled_from([0.0, DT, 2.0 * DT, 15.0 * DT]),
    ),
    max_size=80,
)


def played(force: float, swing: float, frequency: float, seconds: float) -> list[Trust]:
    """The account of a hand that swings, under a force in step with its velocity [N, m, Hz]."""
    w, found = 2.0 * math.pi * frequency, [FULL_TRUST]
    for n in range(round(seconds / DT)):
        moved = swing * (math.sin(w * (n + 1) * DT) - math.sin(w * n * DT))
        found.append(trusted(found[-1], 2.0 + force * math.cos(w * n * DT), moved, DT))
    return found


@given(periods)
def test_as_long_as_models_are_trusted_no_more_than_that_was_made(
    moves: list[tuple[float, float, float]],
) -> None:
    """Of the work in the band; in a late period, by the force that the device has held."""
    works, found = [0.0], [FULL_TRUST]
    held, fast, place = 0.0, 0.0, 0.0  # the force, and its part and that of the tip in the band
    for force, moved, dt in moves:
        after = trusted(found[-1], force, moved, dt)
        passes, before = 0.1 / (0.1 + dt), fast
        fast = passes * (fast + force - held)
        acts = before if dt > 0.0025 else 0.5 * (before + fast)  # late, the held force alone
        works.append(works[-1] + acts * (passes * (place + moved) - place) - ALLOWED * dt)
        place, held = passes * (place + moved), force
        found.append(after)
        assert 0.0 <= after.fraction <= 1.0
        assert after.made >= 0.0
        assert beyond(after) == max(0.0, after.made - MAX_MADE)
    assert all(math.isfinite(value) for trust in found for value in trust)
    for i, start in enumerate(works):
        for j in range(i, len(works)):
            if all(trust.fraction == 1.0 for trust in found[i : j + 1]) and i < j:
                # The period in which it is exceeded is the first without.
                assert works[j] - start <= MAX_MADE + 1e-12 or found[j].made > MAX_MADE


@pytest.mark.parametrize("frequency", [3.0, 8.0, 15.0])
def test_models_that_drive_a_hand_are_out_of_use_soon_and_for_seconds(frequency: float) -> None:
    """By 2 N and 5 mm; their share comes back after it."""
    found = played(2.0, 0.005, frequency, 1.0)
    assert found[-1].fraction == 0.0
    power = 2.0 * 0.005 * math.pi * frequency  # in the mean [W]
    lost = next(n for n, trust in enumerate(found) if trust.fraction < 1.0)
    assert lost * DT <= 3.0 * MAX_MADE / power + 1.0 / frequency
    rest, waits = found[-1], 0
    while rest.fraction < 1.0:
        rest, waits = trusted(rest, 2.0, 0.0, DT), waits + 1
    assert 5.0 <= waits * DT <= 12.0


@given(st.floats(1.0, 20.0), st.floats(0.0, 1.0))
def test_a_spring_alone_costs_no_trust(frequency: float, fraction: float) -> None:
    """Of 400 N/m, up to the energy that the account bears."""
    swing, k = fraction * math.sqrt(MAX_MADE / 400.0), 400.0
    w, trust = 2.0 * math.pi * frequency, FULL_TRUST
    for n in range(3000):
        now, then = swing * math.sin(w * (n + 1) * DT), swing * math.sin(w * n * DT)
        trust = trusted(trust, -k * now, now - then, DT)
        assert trust.fraction == 1.0


@pytest.mark.parametrize("tick", [1, 5, 9], ids=["again", "the same", "the next"])
def test_no_patch_gives_trust_back(tick: int) -> None:
    """A server that leaves out the partners for one patch drove a hand with 25 mW."""
    lost = Trust(fraction=0.0, made=2.0 * MAX_MADE)
    state = replace(receive(LoopState(), replace(PLANE, tick=5), 10.0, SETTINGS), trust=lost)
    for partners in (None, Partners(1.0, 10.0, USUAL_HAND, ()), None):
        patch = replace(PLANE, tick=tick, partners=partners)
        state = receive(state, patch, 20.0, SETTINGS)
        assert state.trust == lost
    after, _ = step(state, at((math.nan, 0.0, 0.0)), 20.001, SETTINGS)
    assert after.trust == lost


@given(periods)
def test_trust_changes_no_faster_than_its_rates(moves: list[tuple[float, float, float]]) -> None:
    found = [FULL_TRUST]
    for force, moved, dt in moves:
        found.append(trusted(found[-1], force, moved, dt))
    for before, after in pairwise(found):
        assert (
            -20.0 * 15.0 * DT - 1e-12 <= after.fraction - before.fraction <= 0.2 * 15.0 * DT + 1e-12
        )
