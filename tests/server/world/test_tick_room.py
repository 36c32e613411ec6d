"""The room's lag in whole ticks, and users who jump, are late, or leave."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.delay import TOO_LONG, UNKNOWN
from cohaptic.control.room_lag import NO_LAG
from cohaptic.control.stability.lag_choice import kept
from cohaptic.vec import ZERO, dot, norm, scale, sub
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import vec3
from cohaptic_server.world.applied_forces import EFFECT_RATE, RELEASE_TIME
from cohaptic_server.world.state import Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState
from tests.examples_of_laws import examples
from tests.server.touches import changed, side, touch
from tests.server.world.worlds import DT, RISE, forces, play

CLOSE = [touch(1), touch(2, at=(1.0, 0.25, 0.0)), touch(3, at=(1.0, -0.25, 0.0))]
# Whose devices may damp nothing.
BARE = [changed(each, damping_budget=0.0) for each in CLOSE]


def test_everybody_is_told_the_same_of_the_room(small_balloon: Balloon) -> None:
    state, patches = play(small_balloon, BARE, 3)
    assert state.room.lag > 0.05
    assert state.room.margin > 1.0
    assert {patch.room for patch in patches.values()} == {state.room}
    # Three at nearly one place: each of two others nearly as soft as the own.
    assert 1.0 < state.room.coupling < 2.0
    # And it does not depend on the delays: moving hands need it, at any of them.
    slow, _ = play(small_balloon, [replace(each, tick=1) for each in BARE], 40)
    assert max(delay.counted for delay in slow.users.tracked.delays) > 20 * DT
    assert slow.room.lag == pytest.approx(state.room.lag, rel=0.05)


def test_no_neighbour_softens_what_a_hand_feels(small_balloon: Balloon) -> None:
    """Science 3.8: K_i = 1 / C_ii, whoever else is there; the room's lag makes it stable."""
    for crowd in (CLOSE[:1], CLOSE[:2], CLOSE):
        _, patches = play(small_balloon, crowd, 3)
        assert patches[1].k_h * patches[1].c_ii == pytest.approx(1.0)


def test_the_body_carries_forces_behind_the_lag_and_says_so(small_balloon: Balloon) -> None:
    """tau f~' = f - f~: what is carried, what the patch says and what the surface shows are one."""
    # Barely pressed, so that nobody is moved faster than may be.
    light = [replace(each, force=scale(each.force, 0.05)) for each in BARE]
    state, patches = play(small_balloon, light, 2 * RISE)
    more = [replace(light[0], force=scale(light[0].force, 3.0)), *light[1:]]
    for _ in range(10):
        before = state
        state, patches = advance(
            TouchedBody(small_balloon), before, more, now=(state.tick + 1) * DT, dt=DT
        )
        user, was = state.users[1], before.users[1].force
        fraction = 1.0 - kept(before.room.lag, DT)
        assert user.force == pytest.approx(was + fraction * (user.requested - was), rel=1e-9)
        assert norm(patches[1].own_force) == pytest.approx(user.force)
        assert state.response is not None
        whole = user.contact.moved(state.response.displacement)
        dent = dot(sub(patches[1].x_free, vec3(whole)), patches[1].normal)
        assert dent == pytest.approx(patches[1].c_ii * user.force, rel=1e-9)
    assert 0.1 < state.users[1].force < 0.95 * state.users[1].requested


@given(st.lists(st.tuples(forces, forces, forces), min_size=1, max_size=12))
@settings(max_examples=examples(10), deadline=None)
def test_nobodys_surface_moves_faster_than_others_may_move_a_hand(
    small_balloon: Balloon, blows: list[tuple[float, float, float]]
) -> None:
    """Whatever they do to it: the force of a hand that keeps still, too, then."""
    state, patches = play(small_balloon, CLOSE)
    for pushes in blows:
        hands = [replace(t, force=scale(side(0.0), f)) for t, f in zip(CLOSE, pushes, strict=True)]
        before = patches
        state, patches = advance(
            TouchedBody(small_balloon), state, hands, now=(state.tick + 1) * DT, dt=DT
        )
        for i, patch in patches.items():
            way = dot(sub(patch.u_others, before[i].u_others), patch.normal)
            # What was known of the coupling is a tick old, and contacts slide to where others have
            # pressed the surface in. Without a limit it would be some ten times as much.
            assert abs(way) * patch.k_h <= 1.5 * EFFECT_RATE * DT


def test_a_probe_that_is_elsewhere_all_at_once_leaves_its_force_where_it_was(
    small_balloon: Balloon,
) -> None:
    """No hand goes so far in a tick: the old place is let go of slowly, the new one is pressed
    only then.
    """
    state, patches = play(small_balloon, [touch()])
    full = state.users[1].force
    there = touch(at=(0.5, 1.0, 0.0))
    for k in range(RISE):
        state, patches = advance(
            TouchedBody(small_balloon), state, [there], now=(state.tick + 1) * DT, dt=DT
        )
        left = sum(r.faded().force for r in state.releases)
        assert left == pytest.approx(full * max(0.0, 1.0 - k * DT / RELEASE_TIME), abs=1e-9)
        if left > 0.0:
            assert (state.users[1].force, state.users[1].presence) == (0.0, 0.0)
            assert patches[1].own_force == ZERO
            # What is left counts as what others do.
            assert norm(patches[1].u_others) > 0.0
    state, patches = play(small_balloon, [there], RISE, state)
    assert state.releases == ()
    assert state.users[1].force == pytest.approx(2.0, rel=0.01)


def test_who_is_too_slow_only_watches(small_balloon: Balloon) -> None:
    """A room waits for its slowest hand, but not for ever."""
    state, patches = play(small_balloon, [touch()])
    late = round((TOO_LONG + 0.5) / DT)
    state = replace(state, tick=state.tick + late)
    for k in range(RISE):
        here = touch(tick=state.tick - late, seq=8 + k)
        state, patches = advance(
            TouchedBody(small_balloon), state, [here], now=(state.tick + 1) * DT, dt=DT
        )
    assert state.users[1].delay.too_long
    assert (state.users[1].presence, state.users[1].force) == (0.0, 0.0)
    assert patches[1].x_free != ZERO


def test_a_force_that_is_held_grows_older_tick_by_tick(small_balloon: Balloon) -> None:
    """No newer sample comes, as on a link that stalls: that is delay, too."""
    state, _ = play(small_balloon, [touch()], 2)
    held = touch(tick=state.tick, seq=8)
    for k in range(1, 25):
        state, _ = advance(
            TouchedBody(small_balloon), state, [held], now=(state.tick + 1) * DT, dt=DT
        )
        assert state.users[1].delay.counted == pytest.approx(k * DT)


def test_a_hand_that_was_away_counts_again_at_once(small_balloon: Balloon) -> None:
    """Its first samples after an outage name a patch of before it."""
    state, _ = play(small_balloon, [touch(tick=1)])
    before = state.tick
    state, _ = play(small_balloon, [touch(tick=before, fresh=False)], round(5.0 / DT), state)
    state, _ = play(small_balloon, [touch(tick=before)], RISE // 4, state)
    for _ in range(2 * RISE - 1):
        state, _ = play(small_balloon, [touch(tick=state.tick)], 1, state)
    state, patches = play(small_balloon, [touch(tick=state.tick)], 1, state)
    assert state.users[1].delay.counted < 1.0
    assert norm(patches[1].own_force) > 0.1


@pytest.mark.parametrize("tick", [0, 1_000_000])
def test_who_answers_no_patch_holds_nobody_up_and_fades(small_balloon: Balloon, tick: int) -> None:
    deaf = [touch(1 + i, at=side(0.1 * i), tick=tick) for i in range(5)]
    state, patches = play(small_balloon, deaf, round(UNKNOWN / DT))
    assert state.room.lag < 0.2
    assert all(norm(patches[user].own_force) > 0.1 for user in state.users)
    state, patches = play(small_balloon, deaf, 4 * RISE, state)
    assert state.room == NO_LAG
    assert all(patches[user].own_force == ZERO for user in state.users)
    # Whoever answers one takes part, with the delay that it has.
    state, patches = play(small_balloon, [touch(1, tick=state.tick), *deaf[1:]], 2, state)
    assert state.users[1].delay.counted == pytest.approx(2 * DT)
    state, patches = play(small_balloon, [touch(1, tick=state.tick), *deaf[1:]], RISE, state)
    assert norm(patches[1].own_force) > 0.1
    assert all(patches[user].own_force == ZERO for user in state.users if user != 1)


@pytest.mark.parametrize("leaves", ["withdraws", "is too slow"])
def test_who_no_longer_takes_part_holds_nobody_up(small_balloon: Balloon, leaves: str) -> None:
    """Behind a lag a force that was let go never quite ends; it counts as none all the same."""

    def hands(tick: int, *, here: bool) -> list[Touch]:
        others = [
            touch(2 + i, at=side(0.1 * i), tick=tick if here or leaves == "withdraws" else 1)
            for i in range(3)
        ]
        if not here and leaves == "withdraws":
            others = [replace(of, probe=scale(of.probe, 3.0), force=ZERO) for of in others]
        return [touch(tick=tick), *others]

    state = WorldState(tick=round(2.0 * TOO_LONG / DT))
    for k in range(60):
        now = replace(hands(state.tick, here=True)[0], seq=k)
        rest = hands(state.tick, here=True)[1:]
        state, _ = advance(TouchedBody(small_balloon), state, [now, *rest], now=k * DT, dt=DT)
    assert state.room.lag > 0.03
    for k in range(60, 900):
        touches = hands(state.tick, here=False)
        state, _ = advance(TouchedBody(small_balloon), state, touches, now=k * DT, dt=DT)
    assert state.room == NO_LAG


def test_one_whose_samples_stopped_lets_go_but_still_gets_patches(small_balloon: Balloon) -> None:
    right = touch(2)
    state, _ = play(small_balloon, [right])
    stale = replace(right, fresh=False)
    state, patches = play(small_balloon, [stale], RISE, state)
    assert patches[2].own_force == ZERO
    state, patches = play(small_balloon, [stale], 100, state)
    assert set(patches) == set(state.users) == {2}
    # And its next sample brings it back as it came.
    state, patches = play(small_balloon, [right], 3, state)
    back = norm(patches[2].own_force)
    assert back == pytest.approx(2.0 * 3 * DT / RELEASE_TIME, rel=0.01)
