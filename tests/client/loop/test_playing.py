"""Surfaces are shown at one constant time after their ticks, however late each patch comes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.playout import LONGEST, RISE
from cohaptic.protocol.patch import Patch
from cohaptic.vec import ZERO, Vec3, add, scale
from cohaptic_client.loop.arrival import MAX_COMING, play, progress, receive, shown
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.step import step
from tests.client.loop.loop_cases import PERIOD, SETTINGS, TICK, at
from tests.client.plane import PLANE

SPEED = 0.02  # m/s with which the plane moves
TICKS = 24  # of half a second or more, of which some are late


def moved(tick: int, t: float) -> Patch:
    """The plane at a time, as a tick of that time says it; it moves steadily."""
    x_free: Vec3 = add(PLANE.x_free, scale(PLANE.normal, SPEED * t))
    return replace(PLANE, tick=tick, t_server=t, x_free=x_free)


def depths(
    patches: list[tuple[float, Patch]], seconds: float, usual: LoopSettings = SETTINGS
) -> list[float]:
    """The time of which each period shows the surface, less its own time [s].

    Args:
        patches: When each patch comes, and the patch, in the order of their coming.
        seconds: Until when periods run.
    """
    state, found, waiting = LoopState(), list[float](), patches[::-1]
    probe = PLANE.x_free
    for k in range(round(seconds / PERIOD)):
        now = PERIOD * k
        while waiting and waiting[-1][0] <= now:
            came, patch = waiting.pop()
            state = receive(state, patch, came, usual)
        state, _ = step(state, at(probe), now, usual)
        sight = shown(state, probe, progress(state, now))
        if sight is not None:
            found.append(sight.depth / SPEED - now)
    return found


def link(gaps: list[int], late: list[float], times: int) -> list[tuple[float, Patch]]:
    """Patches of ticks that are some periods apart, over a link that keeps their order."""
    patches, t, came, tick = list[tuple[float, Patch]](), 0.0, 0.0, 0
    for _ in range(times):
        for gap, lateness in zip(gaps, late, strict=True):
            t, tick = t + gap * TICK, tick + 1
            came = max(came, t + lateness)
            patches.append((came, moved(tick, t)))
    return patches


lateness = st.lists(st.floats(0.0, 0.1), min_size=TICKS, max_size=TICKS)
gaps = st.lists(st.sampled_from([1, 1, 1, 2, 3]), min_size=TICKS, max_size=TICKS)


@settings(max_examples=10)
@given(gaps, lateness)
def test_a_surface_that_moves_steadily_is_shown_to_move_steadily(
    gaps: list[int], late: list[float]
) -> None:
    """Once the link is known: nothing of late ticks and late messages is left but a delay."""
    patches = link([3, *gaps[1:]], [0.1, *late[1:]], 4)
    found = depths(patches, patches[-1][0])[-500:]
    assert max(found) - min(found) <= 1e-6
    assert -found[-1] <= 0.1 + 3.0 * TICK + 2.0 * PERIOD


@settings(max_examples=10)
@given(st.floats(0.0, 0.25))
def test_over_a_link_that_does_not_waver_it_is_late_by_a_tick(delay: float) -> None:
    found = depths(link([1] * 60, [delay] * 60, 1), 1.0)[-500:]
    assert max(found) - min(found) <= 1e-6
    assert -found[-1] <= delay + TICK + 2.0 * PERIOD


@settings(max_examples=10)
@given(lateness, st.floats(0.0, 0.4))
def test_what_is_shown_never_runs_back_and_catches_up_in_no_time(
    late: list[float], stall: float
) -> None:
    """A stall of the link on the way: what was missed is caught up with in half a tick at most."""
    late = [max(each, stall if k > 12 else 0.0) for k, each in enumerate(late)]
    patches = link([1] * TICKS, late, 2)
    found = depths(patches, patches[-1][0])
    shown_times = [each + PERIOD * k for k, each in enumerate(found)]
    ways = [b - a for a, b in pairwise(shown_times[10:])]
    assert min(ways) >= -1e-9
    largest = max(each for each in late) + 3.0 * TICK
    assert max(ways) <= largest / (0.5 * TICK) * PERIOD * (1.0 + RISE)


@given(st.lists(st.tuples(st.floats(allow_nan=False, allow_infinity=False), st.booleans())))
def test_whatever_a_server_says_of_its_clock_a_surface_is_shown(
    stamps: list[tuple[float, bool]],
) -> None:
    state, now = LoopState(), 10.0
    for k, (t, waits) in enumerate(stamps):
        state = receive(state, replace(PLANE, tick=k + 1, t_server=t), now, SETTINGS)
        for _ in range(17 if waits else 1):
            state, _ = step(state, at(ZERO), now, SETTINGS)
            now += PERIOD
            fraction = progress(state, now)
            assert 0.0 <= fraction <= 1.0
            assert shown(state, ZERO, fraction) is not None
    assert len(state.coming) <= MAX_COMING


def test_nothing_begins_before_its_time() -> None:
    state = receive(LoopState(), moved(1, 0.0), 0.0, SETTINGS)
    state = receive(state, moved(2, TICK), 0.002, SETTINGS)
    assert [one.patch.tick for one in state.coming] == [2]
    assert play(state, 0.003, SETTINGS) is state
    later = play(state, LONGEST, SETTINGS)
    assert later.patch is not None
    assert later.patch.tick == 2
    assert later.coming == ()


@pytest.mark.parametrize("late", [0.0, 0.03])
def test_after_a_restart_the_new_clock_counts(late: float) -> None:
    patches = link([1] * 60, [late] * 60, 2)
    old = [(came, replace(patch, t_server=patch.t_server + 1e5)) for came, patch in patches]
    anew = [(came + 4.0, patch) for came, patch in patches]
    assert depths([*old, *anew], 5.0)[-1] == pytest.approx(-4.0 - late - TICK, abs=2.0 * PERIOD)


@pytest.mark.parametrize("stall", [0.5, 1.9, 2.2, 5.0])
def test_after_a_stall_it_is_shown_soon_what_is(stall: float) -> None:
    """All that was held up comes at once."""
    times = [TICK * k for k in range(round((1.5 + stall) / TICK))]
    comes = [max(t + 0.03, 1.0 + stall if t > 1.0 else 0.0) for t in times]
    patches = [
        (came, moved(k + 1, t)) for k, (came, t) in enumerate(zip(comes, times, strict=True))
    ]
    found = depths(patches, 1.5 + stall)
    assert -found[-1] <= 0.03 + 2.0 * TICK + 2.0 * LONGEST
