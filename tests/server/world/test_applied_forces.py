from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.friction import MAX_FRICTION
from cohaptic.control.room_lag import RoomLag
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats
from cohaptic_server.world.applied_forces import (
    EFFECT_RATE,
    FIRST_LAG,
    MAX_INDENTATION,
    MAX_RELEASE_LAG,
    MAX_SUM,
    rows_before,
    update_releases,
)
from cohaptic_server.world.stages.forces import bound_rate, go_ahead, lag, limit
from cohaptic_server.world.stages.hands import release
from cohaptic_server.world.stages.stage import Tick
from cohaptic_server.world.state import NEGLIGIBLE, Release, TickTime, UserState
from cohaptic_server.world.users import Users, WorldState
from tests.examples_of_laws import examples
from tests.server.touches import changed, contact_at, side, touch, tracked_of, user_of, users_of

DT = 1.0 / 60.0  # s
STEP = 0.1  # of a fade, in a tick
JUMP = 0.05  # m
SOFT = 0.004  # m/N
forces = st.floats(0.0, 10.0)
lags = st.sampled_from([0.0, 0.05, 1.0])


def world(users: list[UserState], *, lag: float = 0.0, coupled: float = 0.0) -> WorldState:
    """After a tick in which these users were there, each coupled to each by a share."""
    n = len(users)
    C = SOFT * ((1.0 - coupled) * np.eye(n) + coupled * np.ones((n, n)))
    return WorldState(1, users_of(users), None, (), RoomLag(lag, coupled, 1.0), C)


def apply(body: Balloon, state: WorldState, users: list[UserState]) -> list[UserState]:
    """The users with the forces that the body gets in one tick."""
    tick = Tick(TouchedBody(body), state, {}, TickTime(2, DT, DT, DT), 0.06)
    tick.tracked = tracked_of(users, state.users)
    tick.presence = tick.tracked.presence
    for stage in (release, limit, go_ahead, lag, bound_rate):
        stage(tick)
    return list(Users(tick.tracked, tick.applied).values())


def left_behind(state: WorldState, users: list[UserState]) -> tuple[Release, ...]:
    """Forces that fade where probes have left them."""
    tracked = tracked_of(users, state.users)
    rows, _ = rows_before(state, tracked, JUMP)
    return update_releases(state, tracked, rows, STEP)


def along(user: UserState, size: float) -> Floats:
    """A force along the surface [N]."""
    tangent = np.cross(user.contact.normal, [0.1, 0.2, 1.0])
    return np.asarray(size * tangent / np.linalg.norm(tangent))


# What probes leave behind


def at(body: Balloon, angle: float, force: float, user: int = 1) -> UserState:
    of = touch(user, at=side(angle))
    return user_of(of, contact_at(body, of), force=force)


@given(st.floats(-3.0, 3.0), st.floats(0.0, 5.0))
@settings(max_examples=examples(20), deadline=None)
def test_a_contact_that_no_hand_has_moved_so_far_stays_where_it_was_and_fades(
    small_balloon: Balloon, angle: float, force: float
) -> None:
    was, now = at(small_balloon, 0.0, force), at(small_balloon, angle, 0.0)
    way = float(np.linalg.norm(now.contact.foot - was.contact.foot))
    found = left_behind(world([was]), [now])
    if way > JUMP and force > 0.01:
        (left,) = found
        assert (left.user, left.fraction) == (1, 1.0)
        assert (left.press.contact.frame == was.contact.frame).all()
        assert (left.press.contact.vertices == was.contact.vertices).all()
        assert (left.press.contact.weights == was.contact.weights).all()
        assert left.press.force == force
        assert left.faded().force == force
    elif way < JUMP or force == 0.0:
        assert found == ()


def test_a_fade_ends_and_a_new_one_begins_only_then(small_balloon: Balloon) -> None:
    """One for each user: who jumps to and fro has no more force than one who does not."""
    here, there = at(small_balloon, 0.0, 2.0), at(small_balloon, 2.0, 2.0)
    state, fractions = world([here]), list[float]()
    for k in range(2 * round(1.0 / STEP)):
        found = left_behind(state, [there if k % 2 == 0 else here])
        assert len(found) <= 1
        fractions.append(found[0].fraction if found else 0.0)
        state = replace(world([here if k % 2 else there]), releases=found)
    one = [1.0 - k * STEP for k in range(round(1.0 / STEP))]
    assert fractions[: len(one)] == pytest.approx(one)
    assert fractions.count(1.0) == 2
    # A rounding of the sum of its steps may be left for a tick.
    assert fractions.index(1.0, 1) in (len(one), len(one) + 1)


# What is let in


@given(forces, forces, lags, st.floats(0.0, MAX_FRICTION))
@settings(deadline=None)
def test_one_alone_is_let_in_behind_the_lag_and_no_slower(
    small_balloon: Balloon, before: float, wanted: float, lag: float, mu: float
) -> None:
    """Whatever it does: nobody is there to be moved."""
    rubbed = mu * wanted
    of = touch(friction=True)
    was = user_of(of, contact_at(small_balloon, of), force=before, tangential=np.zeros(3))
    now = replace(
        was, force=0.0, tangential=None, requested=wanted, requested_tangential=along(was, rubbed)
    )
    (found,) = apply(small_balloon, world([was], lag=lag), [now])
    fraction = DT / (lag + DT)
    assert found.force == pytest.approx(before + fraction * (wanted - before))
    assert found.tangential == pytest.approx(fraction * along(was, rubbed))
    assert found.presence == 1.0
    smooth_now = replace(now, touch=touch(), requested_tangential=None)
    (smooth,) = apply(small_balloon, world([was], lag=lag), [smooth_now])
    assert smooth.tangential is None


@given(st.lists(st.tuples(forces, forces), min_size=2, max_size=5), st.floats(0.0, 0.99), lags)
@settings(deadline=None)
def test_nobody_is_moved_faster_than_all_others_may_move_it(
    small_balloon: Balloon, hands: list[tuple[float, float]], coupled: float, lag: float
) -> None:
    was = [at(small_balloon, 1.2 * i, f, i) for i, (f, _) in enumerate(hands, start=1)]
    now = [replace(u, force=0.0, requested=w) for u, (_, w) in zip(was, hands, strict=True)]
    found = apply(small_balloon, world(was, lag=lag, coupled=coupled), now)
    # The first force of a hand passes a lag that is long enough for any hand.
    first = max(lag, FIRST_LAG)
    each = [first if f <= NEGLIGIBLE and w > f else lag for f, w in hands]
    asked = [f + DT / (of + DT) * (w - f) for (f, w), of in zip(hands, each, strict=True)]
    change = np.array([a.force - b.force for a, b in zip(found, was, strict=True)])
    for i, (held, pressed) in enumerate(hands):
        if max(held, pressed) <= NEGLIGIBLE:
            continue  # it feels nothing that could be moved
        others = coupled * np.abs(np.delete(change, i)).sum()
        assert others <= EFFECT_RATE * DT * (1.0 + 1e-9)
    for user, (f, _), a in zip(found, hands, asked, strict=True):
        # On the way, not beyond it, and all of it where nobody is moved too fast.
        assert min(f, a) - 1e-12 <= user.force <= max(f, a) + 1e-12
        if (
            coupled * sum(abs(x - y) for x, (y, _) in zip(asked, hands, strict=True))
            <= 0.9 * EFFECT_RATE * DT
        ):
            assert user.force == pytest.approx(a)


def test_a_contact_that_jumps_moves_no_other_hand_fast(small_balloon: Balloon) -> None:
    """Its coupling was that of another place, though it carried nothing there."""
    holds = replace(at(small_balloon, 0.0, 2.0), requested=2.0)
    there = at(small_balloon, 1.5, 0.0, 2)
    beside = replace(at(small_balloon, 0.2, 0.0, 2), requested=10.0)
    state = world([holds, there], coupled=0.01)
    found = apply(small_balloon, state, [holds, beside])
    assert 0.0 < 10.0 * found[1].force <= EFFECT_RATE * DT * (1.0 + 1e-9)


def test_a_newcomer_whose_coupling_is_not_known_yet_moves_nobody_fast(
    small_balloon: Balloon,
) -> None:
    """It could be at the place of the other."""
    old = at(small_balloon, 0.0, 2.0)
    new = replace(at(small_balloon, 2.0, 0.0, 2), requested=10.0)
    found = apply(small_balloon, world([old]), [replace(old, requested=2.0), new])
    assert found[0].force == 2.0
    assert 0.0 < 10.0 * found[1].force <= EFFECT_RATE * DT * (1.0 + 1e-9)


@given(st.floats(0.0, 10.0), st.floats(0.0, MAX_FRICTION))
@settings(deadline=None)
def test_along_and_normal_are_let_in_in_one_share(
    small_balloon: Balloon, pressed: float, mu: float
) -> None:
    rubbed = mu * pressed
    of = touch(friction=True)
    frictional = user_of(of, contact_at(small_balloon, of), tangential=np.zeros(3))
    still = replace(at(small_balloon, 2.0, 1.0, 2), requested=1.0)
    now = replace(
        frictional,
        tangential=None,
        requested=pressed,
        requested_tangential=along(frictional, rubbed),
    )
    state = world([frictional, still], coupled=0.9)
    found = apply(small_balloon, state, [now, still])[0]
    assert found.tangential is not None
    assert found.tangential * pressed == pytest.approx(
        along(frictional, rubbed) * found.force, abs=1e-9
    )
    moved = found.force + float(np.linalg.norm(found.tangential))
    assert 0.9 * moved <= EFFECT_RATE * DT * (1.0 + 1e-9)


def test_a_body_carries_no_more_than_sixteen_hands_give_along_the_surface_either(
    small_balloon: Balloon,
) -> None:
    users: list[UserState] = []
    for i in range(20):
        of = touch(i + 1, at=side(0.3 * i), friction=True)
        user = user_of(of, contact_at(small_balloon, of), tangential=np.zeros(3))
        pressed = replace(user, force=1.0, requested=10.0)
        users.append(replace(pressed, requested_tangential=along(user, 5.0)))
    state = world(users)
    found = apply(small_balloon, state, users)
    assert sum(user.force for user in found) == pytest.approx(MAX_SUM)
    for user in found:
        assert user.tangential is not None
        assert np.linalg.norm(user.tangential) == pytest.approx(0.5 * user.force)


def test_a_force_that_would_go_through_the_body_is_cut_to_that(
    small_balloon: Balloon,
) -> None:
    user = at(small_balloon, 0.0, 0.0)
    soft = replace(world([user]), coupling=np.array([[1.0]]))
    (found,) = apply(small_balloon, soft, [replace(user, requested=10.0)])
    assert found.force == pytest.approx(MAX_INDENTATION * small_balloon.mesh.size)
    assert found.force < 10.0


def test_who_is_elsewhere_is_not_there_until_its_old_force_has_faded(
    small_balloon: Balloon,
) -> None:
    user = at(small_balloon, 0.0, 2.0)
    left = replace(world([user]), releases=(Release(1, user.press, 1.0),))
    (found,) = apply(small_balloon, left, [replace(user, requested=2.0)])
    assert (found.force, found.presence) == (0.0, 0.0)
    (back,) = apply(small_balloon, world([found]), [replace(user, requested=2.0)])
    assert (back.force, back.presence) == (2.0, 1.0)


@pytest.mark.parametrize("fresh", [True, False])
def test_who_has_left_lets_go_in_the_usual_time_however_slow_the_room_is(
    small_balloon: Balloon, fresh: bool
) -> None:
    user = at(small_balloon, 0.0, 2.0)
    user = replace(user, touch=replace(user.touch, fresh=fresh))
    now = replace(user, requested=0.0)
    (found,) = apply(small_balloon, world([user], lag=5.0), [now])
    lag = 5.0 if fresh else MAX_RELEASE_LAG
    assert found.force == pytest.approx(2.0 * lag / (lag + DT))


@given(st.floats(-1.0, 1.0))
@settings(max_examples=examples(20), deadline=None)
def test_a_force_along_the_surface_turns_with_it(small_balloon: Balloon, angle: float) -> None:
    """What the body carries never pulls at a surface that has turned under the hand."""
    was = at(small_balloon, 0.0, 2.0)
    was = replace(was, touch=changed(was.touch, friction=True), tangential=along(was, 1.0))
    moved = at(small_balloon, angle, 0.0)
    now = replace(moved, touch=was.touch, requested=2.0, requested_tangential=np.zeros(3))
    (found,) = apply(small_balloon, world([was], lag=1.0), [now])
    assert found.tangential is not None
    assert float(found.tangential @ moved.contact.normal) == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(found.tangential) <= 1.0 + 1e-12
