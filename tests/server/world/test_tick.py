from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.delay import TOO_LONG, UNKNOWN
from cohaptic.control.gains import PI_SHARE_K, choose_gains, coupled_stiffness
from cohaptic.control.law import Law
from cohaptic.control.room_lag import NO_LAG
from cohaptic.control.stability.lag_choice import choose_lag, kept
from cohaptic.protocol.frame import MAX_FORCE, MAX_POSITION
from cohaptic.protocol.patch import MIN_COMPLIANCE, Patch
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub, unit
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import vec3
from cohaptic_server.world.contact import REACH
from cohaptic_server.world.force_limits import EFFECT_RATE
from cohaptic_server.world.patch import NEAR
from cohaptic_server.world.state import Touch, WorldState
from cohaptic_server.world.tick import RELEASE_TIME, advance
from tests.server.touches import RADIUS, side, touch

DT = 1.0 / 60.0  # s
# Ticks until a newcomer's force counts in full; one more than the quotient, for its rounding.
RISE = math.ceil(RELEASE_TIME / DT) + 1

angles = st.floats(-math.pi, math.pi)
forces = st.floats(0.0, 10.0)
depths = st.floats(-0.01, 0.02)


def play(
    body: Balloon, touches: Sequence[Touch], ticks: int = RISE, state: WorldState | None = None
) -> tuple[WorldState, dict[int, Patch]]:
    """The world after some ticks of the same touches, and its last patches."""
    state, patches = state or WorldState(), dict[int, Patch]()
    touched = TouchedBody(body)
    for _ in range(ticks):
        state, patches = advance(touched, state, touches, now=0.0, dt=DT)
    return state, patches


@given(st.lists(st.tuples(angles, depths, forces), min_size=1, max_size=3))
@settings(max_examples=20, deadline=None)
def test_a_tick_is_a_function_and_leaves_what_it_was_given(
    small_balloon: Balloon, hands: list[tuple[float, float, float]]
) -> None:
    touches = [touch(i, at=side(a), depth=d, force=f) for i, (a, d, f) in enumerate(hands, start=1)]
    before, _ = play(small_balloon, touches, 3)
    assert before.response is not None
    users, displacement = dict(before.users), before.response.displacement.copy()
    after, patches = advance(TouchedBody(small_balloon), before, touches, now=1.0, dt=DT)
    again, patches_again = advance(TouchedBody(small_balloon), before, touches, now=1.0, dt=DT)
    assert patches == patches_again
    assert after.response is not None
    assert again.response is not None
    assert (after.response.displacement == again.response.displacement).all()
    assert before.tick == 3
    assert dict(before.users) == users
    assert (before.response.displacement == displacement).all()


@given(angles, st.floats(0.0, 0.02), forces, forces, angles, forces)
@settings(max_examples=30, deadline=None)
def test_a_patch_is_free_of_its_users_own_force(
    small_balloon: Balloon,
    angle: float,
    depth: float,
    one: float,
    other: float,
    neighbour: float,
    pressed: float,
) -> None:
    """Science 3.3: whatever force a client sends, the surface it gets back is the same.

    Not so its gain: who presses here may lift the body towards a neighbour, who then counts.
    """
    beside = touch(2, at=side(neighbour), force=pressed)
    state, _ = play(small_balloon, [touch(1, at=side(angle), depth=depth), beside], 5)

    def patch(force: float) -> Patch:
        mine = touch(1, at=side(angle), depth=depth, force=force)
        return advance(TouchedBody(small_balloon), state, [mine, beside], now=0.0, dt=DT)[1][1]

    a, b = patch(one), patch(other)
    # Own field added and taken out again: rounding of a displacement of a few centimetres.
    assert a.x_free == pytest.approx(b.x_free, abs=1e-15)
    assert a.u_others == pytest.approx(b.u_others, abs=1e-15)
    assert (a.normal, a.c_ii) == (b.normal, b.c_ii)


@given(angles, st.floats(-0.4, 1.0), forces)
@settings(max_examples=20, deadline=None)
def test_a_lone_user_meets_the_resting_surface(
    small_balloon: Balloon, angle: float, z: float, force: float
) -> None:
    out = unit((math.cos(angle), math.sin(angle), z))
    _, patches = play(small_balloon, [touch(at=out, force=force)], 4)
    assert patches[1].u_others == pytest.approx(ZERO, abs=1e-15)
    # On the inflated mesh, whose facets lie up to 2 mm inside the sphere.
    assert RADIUS - 0.004 < norm(patches[1].x_free) < RADIUS + 0.001


@given(st.lists(st.tuples(angles, st.floats(0.1, 5.0)), min_size=2, max_size=5), st.data())
@settings(max_examples=20, deadline=None)
def test_gains_and_stiffnesses_follow_from_the_rows_of_c(
    small_balloon: Balloon, hands: list[tuple[float, float]], data: st.DataObject
) -> None:
    """All press, so all count: gains are `choose_gains` of the whole row, for every law."""
    laws = data.draw(st.lists(st.sampled_from(Law), min_size=len(hands), max_size=len(hands)))
    limit = data.draw(st.floats(10.0, 1000.0))
    touches = [
        replace(touch(i, at=side(angle), depth=0.01, force=force), law=law, max_stiffness=limit)
        for i, ((angle, force), law) in enumerate(zip(hands, laws, strict=True), start=1)
    ]
    state, patches = advance(TouchedBody(small_balloon), WorldState(), touches, now=0.0, dt=DT)
    assert state.response is not None
    for i, patch in enumerate(patches.values()):
        row = state.response.compliance[i].tolist()
        assert patch.c_ii == row[i]
        coupled = state.users[i + 1].k_o_coupled
        assert coupled == pytest.approx(coupled_stiffness(row), rel=1e-12)
        gains = choose_gains(
            laws[i],
            row,
            i,
            max_stiffness=limit,
            loop_delay=UNKNOWN + state.room.lag,
            simulation_period=DT,
        )
        assert (patch.law, patch.k_h, patch.integral_gain) == (laws[i], *gains)


@pytest.mark.parametrize("friction", [False, True])
def test_what_others_do_is_said_in_all_three_directions(balloon: Balloon, friction: bool) -> None:
    """Opposite contacts push each other out; u_others is how far, as x_free shows it.

    Beside each other they also drag each other along. In the first tick, in which every contact is
    still found on the resting surface.
    """
    left = replace(touch(1, at=(-1.0, 0.3, 0.0)), friction=friction)
    right = replace(touch(2, force=3.0), friction=friction, force=(3.0, 1.0, 0.5))
    _, alone = play(balloon, [left], 1)
    _, both = play(balloon, [left, right], 1)
    lift = dot(both[1].u_others, both[1].normal)
    assert lift > 1e-4
    assert norm(sub(both[1].u_others, scale(both[1].normal, lift))) > 1e-5
    way = sub(both[1].x_free, alone[1].x_free)
    assert way == pytest.approx(both[1].u_others, abs=1e-15)


# The room


CLOSE = [touch(1), touch(2, at=(1.0, 0.25, 0.0)), touch(3, at=(1.0, -0.25, 0.0))]
# Whose devices may damp nothing.
BARE = [replace(each, damping_budget=0.0) for each in CLOSE]


def test_everybody_is_told_the_same_of_the_room(small_balloon: Balloon) -> None:
    state, patches = play(small_balloon, BARE, 3)
    assert state.room.lag > 0.05
    assert state.room.margin > 1.0
    assert {patch.room for patch in patches.values()} == {state.room}
    # Three at nearly one place: each of two others nearly as soft as the own.
    assert 1.0 < state.room.coupling < 2.0
    assert state.room == choose_lag(state.room.coupling, DT, 0.0)


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
        state, patches = advance(TouchedBody(small_balloon), before, more, now=0.0, dt=DT)
        user, was = state.users[1], before.users[1].force
        share = 1.0 - kept(before.room.lag, DT)
        assert user.force == pytest.approx(was + share * (user.wanted - was), rel=1e-9)
        assert norm(patches[1].own_force) == pytest.approx(user.force)
        assert state.response is not None
        whole = user.contact.moved(state.response.displacement)
        dent = dot(sub(patches[1].x_free, vec3(whole)), patches[1].normal)
        assert dent == pytest.approx(patches[1].c_ii * user.force, rel=1e-9)
    assert 0.1 < state.users[1].force < 0.95 * state.users[1].wanted


@given(st.lists(st.tuples(forces, forces, forces), min_size=1, max_size=12))
@settings(max_examples=10, deadline=None)
def test_nobodys_surface_moves_faster_than_others_may_move_a_hand(
    small_balloon: Balloon, blows: list[tuple[float, float, float]]
) -> None:
    """Whatever they do to it: the force of a hand that keeps still, too, then."""
    state, patches = play(small_balloon, CLOSE)
    for pushes in blows:
        hands = [replace(t, force=scale(side(0.0), f)) for t, f in zip(CLOSE, pushes, strict=True)]
        before = patches
        state, patches = advance(TouchedBody(small_balloon), state, hands, now=0.0, dt=DT)
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
        state, patches = advance(TouchedBody(small_balloon), state, [there], now=0.0, dt=DT)
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
        state, patches = advance(TouchedBody(small_balloon), state, [here], now=0.0, dt=DT)
    assert state.users[1].delay.too_long
    assert (state.users[1].presence, state.users[1].force) == (0.0, 0.0)
    assert patches[1].x_free != ZERO


def test_a_force_that_is_held_grows_older_tick_by_tick(small_balloon: Balloon) -> None:
    """No newer sample comes, as on a link that stalls: that is delay, too."""
    state, _ = play(small_balloon, [touch()], 2)
    held = touch(tick=state.tick, seq=8)
    for k in range(1, 25):
        state, _ = advance(TouchedBody(small_balloon), state, [held], now=0.0, dt=DT)
        assert state.users[1].delay.counted == pytest.approx(k * DT)


def test_who_presses_and_names_no_patch_may_have_any_delay(small_balloon: Balloon) -> None:
    state, _ = play(small_balloon, [touch(tick=0)], 2 * RISE)
    assert state.users[1].delay.counted == UNKNOWN


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


@pytest.mark.parametrize(("height", "carried"), [(-0.02, True), (0.028, True), (0.032, False)])
def test_a_force_counts_only_within_reach_of_the_surface(
    small_balloon: Balloon, height: float, carried: bool
) -> None:
    """Facets of the coarse balloon lie up to 2 mm inside: heights keep that off the limit."""
    _, patches = play(small_balloon, [touch(depth=-height), touch(2, at=(-1.0, 0.0, 0.0), force=0)])
    assert (norm(patches[1].own_force) > 0.0) == carried
    assert (norm(patches[2].u_others) > 1e-4) == carried


def test_the_body_carries_only_what_presses_and_what_the_device_gives(
    small_balloon: Balloon,
) -> None:
    def carried(force: Vec3) -> float:
        patch = play(small_balloon, [replace(touch(), force=force)])[1][1]
        own = dot(patch.own_force, patch.normal)
        assert patch.own_force == pytest.approx(scale(patch.normal, own), abs=1e-12)
        return own

    _, patches = play(small_balloon, [touch()])
    n = patches[1].normal
    tangent = sub((0.0, 0.0, 5.0), scale(n, 5.0 * n[2]))
    assert carried(scale(n, 2.0)) == pytest.approx(2.0)
    assert carried(add(scale(n, 2.0), tangent)) == pytest.approx(2.0)
    assert carried(scale(n, -2.0)) == 0.0  # a surface only pushes
    assert carried(scale(n, 50.0)) == pytest.approx(10.0)


def test_a_newcomers_force_rises_over_the_release_time(small_balloon: Balloon) -> None:
    state, carried = WorldState(), list[float]()
    for _ in range(RISE + 5):
        state, patches = advance(
            TouchedBody(small_balloon), state, [touch(force=2.0)], now=0.0, dt=DT
        )
        carried.append(norm(patches[1].own_force))
    full = carried[-1]
    assert full == pytest.approx(2.0, rel=0.01)  # the mesh's normal is not quite the force's
    expected = [full * min(1.0, k * DT / RELEASE_TIME) for k in range(1, RISE + 6)]
    assert carried == pytest.approx(expected, rel=1e-9)


def test_one_who_left_lets_go_over_the_release_time_and_is_gone(small_balloon: Balloon) -> None:
    # So soft that the room needs no lag.
    left, right = (
        touch(i, at=at, max_stiffness=100.0)
        for i, at in ((1, (-1.0, 0.0, 0.0)), (2, (1.0, 0.0, 0.0)))
    )
    state, patches = play(small_balloon, [left, right])
    assert state.room.lag == 0.0
    full, lifts = state.users[2].force, [norm(patches[1].u_others)]
    for k in range(1, RISE + 1):
        state, patches = advance(TouchedBody(small_balloon), state, [left], now=0.0, dt=DT)
        assert set(patches) == {1}
        lifts.append(norm(patches[1].u_others))
        left_over = state.users[2].force if 2 in state.users else 0.0
        share = max(0.0, 1.0 - k * DT / RELEASE_TIME)
        assert left_over == pytest.approx(full * share, rel=0.01, abs=1e-9)
    assert set(state.users) == {1}
    assert lifts == sorted(lifts, reverse=True)
    assert lifts[-1] == pytest.approx(0.0, abs=1e-15)


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


@given(st.lists(st.sets(st.integers(1, 4)), min_size=1, max_size=40))
@settings(max_examples=20, deadline=None)
def test_whoever_comes_and_goes_nobodys_force_jumps(
    small_balloon: Balloon, attendance: list[set[int]]
) -> None:
    """A user's share in the body never changes by more than a step of the ramp."""
    state, shares = WorldState(), dict[int, float]()
    for here in attendance:
        touches = [touch(i, at=side(1.5 * i), force=2.0) for i in sorted(here)]
        state, patches = advance(TouchedBody(small_balloon), state, touches, now=0.0, dt=DT)
        assert set(patches) == here
        now = {number: user.presence for number, user in state.users.items()}
        for number in now.keys() | shares.keys():
            step = abs(now.get(number, 0.0) - shares.get(number, 0.0))
            assert step <= DT / RELEASE_TIME + 1e-12
        shares = now


def test_a_neighbour_counts_from_where_it_may_touch_next(small_balloon: Balloon) -> None:
    """Near the surface it is a contact already; out of reach it costs nobody any stiffness."""

    def coupled(height: float) -> float:
        beside = touch(2, at=(1.0, 0.6, 0.0), depth=-height, force=0.0)
        return play(small_balloon, [touch(), beside], 2)[0].users[1].k_o_coupled

    alone = play(small_balloon, [touch()], 2)[0].users[1].k_o_coupled
    # Facets lie up to 2 mm inside the sphere that heights are counted from here.
    heights = np.linspace(0.0, REACH + 0.01, 41)
    values = [coupled(h) for h in heights]
    assert values == sorted(values)
    assert values[-1] == pytest.approx(alone, rel=1e-12)
    near = [v for h, v in zip(heights, values, strict=True) if h < NEAR - 0.003]
    assert len(near) > 1
    assert near == pytest.approx([near[0]] * len(near), rel=1e-3)
    assert near[0] < 0.9 * alone
    # From there on without a step: a millimetre of height is a 25th of the way.
    assert np.diff(values).max() < 0.1 * (alone - near[0])


@pytest.mark.parametrize("law", Law)
def test_a_contact_on_the_held_base_is_very_stiff_and_no_division_by_zero(
    balloon: Balloon, law: Law
) -> None:
    below = replace(touch(at=(0.0, 0.0, -1.0)), law=law, max_stiffness=800.0)
    _, patches = play(balloon, [below], 3)
    patch = patches[1]
    assert patch.c_ii == MIN_COMPLIANCE
    assert patch.k_h == (PI_SHARE_K * 800.0 if law is Law.PI else 800.0)
    assert patch.u_others == ZERO
    assert Patch.decode(patch.encode()).tick == patch.tick


@given(st.floats(0.0, 100.0), st.floats(-5.0, 100.0))
def test_a_sample_waited_from_its_arrival_to_the_tick(
    small_balloon: Balloon, arrived: float, wait: float
) -> None:
    """Never less than nothing: a sample may be stamped after the tick began."""
    here = replace(touch(), arrived=arrived)
    now = arrived + wait
    _, patches = advance(TouchedBody(small_balloon), WorldState(), [here], now=now, dt=DT)
    patch = patches[1]
    assert patch.sample_wait == max(0.0, now - arrived)
    assert (patch.t_server, patch.t_client, patch.seq) == (now, here.t_client, here.seq)


def test_ticks_count_from_one_also_when_nobody_is_there(small_balloon: Balloon) -> None:
    state, patches = play(small_balloon, [], 3)
    assert (state.tick, patches) == (3, {})
    state, patches = play(small_balloon, [touch()], 1, state)
    assert patches[1].tick == state.tick == 4


wild_vectors = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@given(
    st.lists(
        st.tuples(
            wild_vectors.map(lambda v: scale(v, MAX_POSITION / 2)) | wild_vectors,
            wild_vectors.map(lambda v: scale(v, MAX_FORCE / 2)),
        ),
        min_size=1,
        max_size=4,
    )
)
@settings(max_examples=30, deadline=None)
def test_whatever_a_few_hands_do_their_patches_can_be_sent(
    small_balloon: Balloon, hands: list[tuple[Vec3, Vec3]]
) -> None:
    """Anything that a contact sample may say, also from inside the body or metres away."""
    touches = [
        replace(touch(i), max_force=MAX_FORCE, probe=p, force=f)
        for i, (p, f) in enumerate(hands, start=1)
    ]
    state = WorldState()
    for _ in range(4):
        state, patches = advance(TouchedBody(small_balloon), state, touches, now=0.0, dt=DT)
        for patch in patches.values():
            assert Patch.decode(patch.encode()).tick == state.tick
