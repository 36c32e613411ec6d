"""The account of the energy that a contact returns to the hand, and the trust in models."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_client.loop.trust import ALLOWED, FULL_TRUST, MOST_MADE, Trust, beyond, trusted

DT = 0.001  # s
periods = st.lists(
    st.tuples(st.floats(-10.0, 10.0), st.floats(-2e-3, 2e-3), st.sampled_from([0.0, DT, 2.0 * DT])),
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
    """Of the work in the band between any two times."""
    works, found = [0.0], [FULL_TRUST]
    for force, moved, dt in moves:
        after = trusted(found[-1], force, moved, dt)
        before = found[-1]
        work = 0.5 * (before.force + after.force) * (after.place - before.place)
        works.append(works[-1] + work - ALLOWED * dt)
        found.append(after)
        assert 0.0 <= after.share <= 1.0
        assert after.made >= 0.0
        assert beyond(after) == max(0.0, after.made - MOST_MADE)
    assert all(math.isfinite(value) for trust in found for value in trust)
    for i, start in enumerate(works):
        for j in range(i, len(works)):
            if all(trust.share == 1.0 for trust in found[i : j + 1]) and i < j:
                # The period in which it is exceeded is the first without.
                assert works[j] - start <= MOST_MADE + 1e-12 or found[j].made > MOST_MADE


@pytest.mark.parametrize("frequency", [3.0, 8.0, 15.0])
def test_models_that_drive_a_hand_are_out_of_use_soon_and_for_seconds(frequency: float) -> None:
    """By 2 N and 5 mm; their share comes back after it."""
    found = played(2.0, 0.005, frequency, 1.0)
    assert found[-1].share == 0.0
    power = 2.0 * 0.005 * math.pi * frequency  # in the mean [W]
    lost = next(n for n, trust in enumerate(found) if trust.share < 1.0)
    assert lost * DT <= 3.0 * MOST_MADE / power + 1.0 / frequency
    rest, waits = found[-1], 0
    while rest.share < 1.0:
        rest, waits = trusted(rest, 2.0, 0.0, DT), waits + 1
    assert 5.0 <= waits * DT <= 12.0


def test_what_a_resting_hand_damps_costs_no_trust() -> None:
    """1 mW for half a minute."""
    power = 0.001
    force = power / (0.5 * 1e-3 * 2.0 * math.pi * 5.0)
    assert all(trust.share == 1.0 for trust in played(force, 1e-3, 5.0, 30.0))


@given(st.floats(1.0, 20.0), st.floats(0.0, 1.0))
def test_a_spring_alone_costs_no_trust(frequency: float, share: float) -> None:
    """Of 400 N/m, up to the energy that the account bears."""
    swing, k = share * math.sqrt(MOST_MADE / 400.0), 400.0
    w, trust = 2.0 * math.pi * frequency, FULL_TRUST
    for n in range(3000):
        now, then = swing * math.sin(w * (n + 1) * DT), swing * math.sin(w * n * DT)
        trust = trusted(trust, -k * now, now - then, DT)
        assert trust.share == 1.0


@given(periods)
def test_trust_changes_no_faster_than_its_rates(moves: list[tuple[float, float, float]]) -> None:
    found = [FULL_TRUST]
    for force, moved, dt in moves:
        found.append(trusted(found[-1], force, moved, dt))
    for before, after in pairwise(found):
        assert -20.0 * 2.0 * DT - 1e-12 <= after.share - before.share <= 0.2 * 2.0 * DT + 1e-12
