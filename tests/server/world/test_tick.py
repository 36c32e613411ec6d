from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.delay import UNKNOWN
from cohaptic.control.gains import choose_gains
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains, coupled_stiffness
from cohaptic.control.laws.pi import PI_FRACTION_K
from cohaptic.protocol.frame import MAX_FORCE, MAX_POSITION
from cohaptic.protocol.patch import MIN_COMPLIANCE, Patch
from cohaptic.vec import ZERO, Vec3, add, dot, norm, scale, sub
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.world.applied_forces import RELEASE_TIME
from cohaptic_server.world.contact import MAX_CONTACT_HEIGHT
from cohaptic_server.world.stages.surfaces import NEAR_HEIGHT
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState
from tests.examples_of_laws import examples
from tests.server.touches import changed, side, touch
from tests.server.world.worlds import DT, RISE, angles, depths, forces, play


@given(st.lists(st.tuples(angles, depths, forces), min_size=1, max_size=3))
@settings(max_examples=examples(20), deadline=None)
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
@settings(max_examples=examples(30), deadline=None)
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
        return advance(
            TouchedBody(small_balloon), state, [mine, beside], now=(state.tick + 1) * DT, dt=DT
        )[1][1]

    a, b = patch(one), patch(other)
    # Own field added and taken out again: rounding of a displacement of a few centimetres.
    assert a.x_free == pytest.approx(b.x_free, abs=1e-15)
    assert a.u_others == pytest.approx(b.u_others, abs=1e-15)
    assert (a.normal, a.c_ii) == (b.normal, b.c_ii)


@given(st.lists(st.tuples(angles, st.floats(0.1, 5.0)), min_size=2, max_size=5), st.data())
@settings(max_examples=examples(20), deadline=None)
def test_gains_and_stiffnesses_follow_from_the_rows_of_c(
    small_balloon: Balloon, hands: list[tuple[float, float]], data: st.DataObject
) -> None:
    """All press, so all count: gains are `choose_gains` of the whole row, for every law."""
    laws = data.draw(st.lists(st.sampled_from(Law), min_size=len(hands), max_size=len(hands)))
    limit = data.draw(st.floats(10.0, 1000.0))
    touches = [
        changed(touch(i, at=side(angle), depth=0.01, force=force), law=law, max_stiffness=limit)
        for i, ((angle, force), law) in enumerate(zip(hands, laws, strict=True), start=1)
    ]
    state, patches = advance(TouchedBody(small_balloon), WorldState(), touches, now=DT, dt=DT)
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
        assert (patch.law, Gains(patch.k_h, patch.integral_gain)) == (laws[i], gains)


@pytest.mark.parametrize("friction", [False, True])
def test_what_others_do_is_said_in_all_three_directions(balloon: Balloon, friction: bool) -> None:
    """Opposite contacts push each other out; u_others is how far, as x_free shows it.

    Beside each other they also drag each other along. In the first tick, in which every contact is
    still found on the resting surface.
    """
    left = changed(touch(1, at=(-1.0, 0.3, 0.0)), friction=friction)
    right = changed(touch(2, force=3.0), friction=friction, force=(3.0, 1.0, 0.5))
    _, alone = play(balloon, [left], 1)
    _, both = play(balloon, [left, right], 1)
    lift = dot(both[1].u_others, both[1].normal)
    assert lift > 5e-6
    assert norm(sub(both[1].u_others, scale(both[1].normal, lift))) > 5e-7
    way = sub(both[1].x_free, alone[1].x_free)
    assert way == pytest.approx(both[1].u_others, abs=1e-15)


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
            TouchedBody(small_balloon), state, [touch(force=2.0)], now=(state.tick + 1) * DT, dt=DT
        )
        carried.append(norm(patches[1].own_force))
    full = carried[-1]
    assert full == pytest.approx(2.0, rel=0.01)  # the mesh's normal is not quite the force's
    expected = [full * min(1.0, k * DT / RELEASE_TIME) for k in range(1, RISE + 6)]
    assert carried == pytest.approx(expected, rel=1e-9)


def test_one_who_left_lets_go_over_the_release_time_and_is_gone(small_balloon: Balloon) -> None:
    # So soft that the room needs hardly any lag.
    left, right = (
        touch(i, at=at, max_stiffness=1.0)
        for i, at in ((1, (-1.0, 0.0, 0.0)), (2, (1.0, 0.0, 0.0)))
    )
    state, patches = play(small_balloon, [left, right])
    assert state.room.lag < 1e-3
    full, lifts = state.users[2].force, [norm(patches[1].u_others)]
    for k in range(1, RISE + 1):
        state, patches = advance(
            TouchedBody(small_balloon), state, [left], now=(state.tick + 1) * DT, dt=DT
        )
        assert set(patches) == {1}
        lifts.append(norm(patches[1].u_others))
        left_over = state.users[2].force if 2 in state.users else 0.0
        fraction = max(0.0, 1.0 - k * DT / RELEASE_TIME)
        assert left_over == pytest.approx(full * fraction, rel=0.01, abs=1e-9)
    assert set(state.users) == {1}
    assert lifts == sorted(lifts, reverse=True)
    assert lifts[-1] == pytest.approx(0.0, abs=1e-15)


@given(st.lists(st.sets(st.integers(1, 4)), min_size=1, max_size=40))
@settings(max_examples=examples(20), deadline=None)
def test_whoever_comes_and_goes_nobodys_force_jumps(
    small_balloon: Balloon, attendance: list[set[int]]
) -> None:
    """A user's share in the body never changes by more than a step of the ramp."""
    state, fractions = WorldState(), dict[int, float]()
    for here in attendance:
        touches = [touch(i, at=side(1.5 * i), force=2.0) for i in sorted(here)]
        state, patches = advance(
            TouchedBody(small_balloon), state, touches, now=(state.tick + 1) * DT, dt=DT
        )
        assert set(patches) == here
        now = {number: user.presence for number, user in state.users.items()}
        for number in now.keys() | fractions.keys():
            step = abs(now.get(number, 0.0) - fractions.get(number, 0.0))
            assert step <= DT / RELEASE_TIME + 1e-12
        fractions = now


def test_a_neighbour_counts_from_where_it_may_touch_next(small_balloon: Balloon) -> None:
    """Near the surface it is a contact already; out of reach it costs nobody any stiffness."""

    def coupled(height: float) -> float:
        beside = touch(2, at=(1.0, 0.6, 0.0), depth=-height, force=0.0)
        return play(small_balloon, [touch(), beside], 2)[0].users[1].k_o_coupled

    alone = play(small_balloon, [touch()], 2)[0].users[1].k_o_coupled
    # Facets lie up to 2 mm inside the sphere that heights are counted from here.
    heights = np.linspace(0.0, MAX_CONTACT_HEIGHT + 0.01, 41)
    values = [coupled(h) for h in heights]
    assert values == sorted(values)
    assert values[-1] == pytest.approx(alone, rel=1e-12)
    near = [v for h, v in zip(heights, values, strict=True) if h < NEAR_HEIGHT - 0.003]
    assert len(near) > 1
    assert near == pytest.approx([near[0]] * len(near), rel=1e-3)
    assert near[0] < 0.9 * alone
    # From there on without a step: a millimetre of height is a 25th of the way.
    assert np.diff(values).max() < 0.1 * (alone - near[0])


@pytest.mark.parametrize("law", Law)
def test_a_contact_on_the_held_base_is_very_stiff_and_no_division_by_zero(
    balloon: Balloon, law: Law
) -> None:
    below = changed(touch(at=(0.0, 0.0, -1.0)), law=law, max_stiffness=800.0)
    _, patches = play(balloon, [below], 3)
    patch = patches[1]
    assert patch.c_ii == MIN_COMPLIANCE
    assert patch.k_h == (PI_FRACTION_K * 800.0 if law is Law.PI else 800.0)
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
@settings(max_examples=examples(30), deadline=None)
def test_whatever_a_few_hands_do_their_patches_can_be_sent(
    small_balloon: Balloon, hands: list[tuple[Vec3, Vec3]]
) -> None:
    """Anything that a contact sample may say, also from inside the body or metres away."""
    touches = [
        changed(touch(i), max_force=MAX_FORCE, probe=p, force=f)
        for i, (p, f) in enumerate(hands, start=1)
    ]
    state = WorldState()
    for _ in range(4):
        state, patches = advance(
            TouchedBody(small_balloon), state, touches, now=(state.tick + 1) * DT, dt=DT
        )
        for patch in patches.values():
            assert Patch.decode(patch.encode()).tick == state.tick
