from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic.control.stability.lag_choice import FULL_BUDGET
from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic.protocol.messages import FixedGains, RoomUser, SetLaw, UserJoined, UserLeft
from cohaptic.protocol.patch import Geometry
from cohaptic.vec import norm
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.room.body_frames import describe
from cohaptic_server.room.life import STALE_AFTER
from cohaptic_server.room.room import Room
from cohaptic_server.room.seats.names import KEPT_FOR, REPLACE_AFTER, SEAT_KEPT_FOR
from cohaptic_server.settings import ServerSettings
from cohaptic_server.world.applied_forces import RELEASE_TIME
from tests.examples_of_laws import examples
from tests.server.peers import hello, sample


def room(body: Balloon, max_users: int = 4, simulation_hz: float = 60.0) -> Room:
    return Room(body, ServerSettings(max_users=max_users, simulation_hz=simulation_hz))


def enter(where: Room, name: str, now: float = 0.0) -> int:
    return where.join(hello(name), now)[0].user


def test_a_welcome_says_what_a_client_needs(small_balloon: Balloon) -> None:
    here = room(small_balloon, simulation_hz=50.0)
    first, news, replaced = here.join(hello("left"), 0.0)
    assert (first.name, first.users, replaced) == ("left", (), ())
    assert news == UserJoined(user=first.user, name="left")
    assert first.simulation_period == 0.02
    assert first.body == describe(small_balloon)
    second, _, _ = here.join(hello("right"), 0.0)
    assert second.users == (RoomUser(user=first.user, name="left"),)
    assert second.user != first.user


def test_a_name_in_use_is_refused_with_those_that_are_taken(small_balloon: Balloon) -> None:
    here = room(small_balloon)
    enter(here, "left")
    enter(here, "right")
    with pytest.raises(RemoteProtocolError, match=r"'left'.*taken: left, right") as caught:
        enter(here, "left")
    assert caught.value.code is CloseCode.NAME_TAKEN
    assert len(here.members) == 2


def test_fixed_gains_need_leave_and_are_then_what_patches_carry(small_balloon: Balloon) -> None:
    asked = FixedGains(k_h=123.0, integral_gain=456.0)
    strict = room(small_balloon)
    with pytest.raises(RemoteProtocolError, match="--allow-fixed-gains"):
        strict.join(hello("left").model_copy(update={"fixed_gains": asked}), 0.0)
    assert not strict.members
    lenient = Room(small_balloon, ServerSettings(allow_fixed_gains=True))
    user = enter(lenient, "left")
    lenient.sample(user, sample(), 0.0)
    chosen = lenient.tick(0.0)[user]
    lenient.set_law(user, SetLaw(law=Law.PI, fixed_gains=asked), 0.0)
    patch = lenient.tick(0.02)[user]
    assert (patch.law, patch.k_h, patch.integral_gain) == (Law.PI, 123.0, 456.0)
    lenient.set_law(user, SetLaw(law=Law.PREDICTIVE), 0.0)
    assert lenient.tick(0.04)[user].k_h == pytest.approx(chosen.k_h, rel=1e-6)


def test_a_full_room_is_refused_with_its_limit(small_balloon: Balloon) -> None:
    here = room(small_balloon, max_users=2)
    numbers = [enter(here, "left"), enter(here, "right")]
    with pytest.raises(RemoteProtocolError, match="users is 3; expected at most 2") as caught:
        enter(here, "third")
    assert caught.value.code is CloseCode.ROOM_FULL
    here.leave(numbers[0], 0.0)
    assert enter(here, "third") not in numbers


@pytest.mark.parametrize("max_users", [1, 4])
def test_a_silent_user_keeps_its_name_for_a_while_and_no_longer(
    small_balloon: Balloon, max_users: int
) -> None:
    """Its return finds a place also in a full room: it is its own."""
    here = room(small_balloon, max_users)
    old = enter(here, "left", now=10.0)
    here.sample(old, sample(), 11.0)
    with pytest.raises(RemoteProtocolError):
        enter(here, "left", now=11.0 + REPLACE_AFTER - 0.01)
    welcome, news, replaced = here.join(hello("left"), 11.0 + REPLACE_AFTER)
    assert [left.user for left in replaced] == [old]
    assert welcome.user == news.user != old
    assert welcome.users == ()
    assert set(here.members) == {welcome.user}
    # The end of the old connection is then no news any more.
    assert here.leave(old, 0.0) is None


def test_a_name_with_a_secret_goes_to_nobody_else_however_long_its_owner_is_silent(
    small_balloon: Balloon,
) -> None:
    here = room(small_balloon)
    mine, stolen = (hello("left").model_copy(update={"key": key * 16}) for key in "ab")
    old = here.join(mine, 0.0, "there")[0].user
    for thief in (stolen, hello("left")):
        with pytest.raises(RemoteProtocolError) as caught:
            here.join(thief, 1000.0, "there")
        assert caught.value.code is CloseCode.NAME_TAKEN
    # Its owner need not be silent, and may come from another address.
    here.sample(old, sample(), 1000.0)
    (left,) = here.join(mine, 1000.0, "elsewhere")[2]
    assert left.user == old


def test_the_name_of_a_lost_connection_is_kept_for_its_owner_and_not_for_ever(
    small_balloon: Balloon,
) -> None:
    mine = hello("left").model_copy(update={"key": "a" * 16})
    for owner, source in ((mine, "elsewhere"), (hello("left"), "home")):
        here = room(small_balloon)
        here.leave(here.join(mine, 0.0, "home")[0].user, 1.0, lost=True)
        with pytest.raises(RemoteProtocolError, match=r"kept for 30 s for one whose"):
            here.join(hello("left"), 1.0 + KEPT_FOR - 30.0, "elsewhere")
        assert here.join(owner, 1.0 + KEPT_FOR - 30.0, source)[2] == ()
    here = room(small_balloon)
    here.leave(here.join(mine, 0.0, "home")[0].user, 1.0, lost=True)
    assert here.join(hello("left"), 1.0 + KEPT_FOR, "elsewhere")[2] == ()


def test_the_seat_of_a_lost_connection_is_kept_for_its_owner_and_not_for_long(
    small_balloon: Balloon,
) -> None:
    here = room(small_balloon, max_users=2)
    mine = hello("left").model_copy(update={"key": "a" * 16})
    here.join(hello("right"), 0.0, "there")
    here.leave(here.join(mine, 0.0, "home")[0].user, 20.0, lost=True)
    with pytest.raises(RemoteProtocolError, match=r"1 of them kept .* try again") as caught:
        here.join(hello("third"), 20.0 + 0.9 * SEAT_KEPT_FOR, "there")
    assert caught.value.code is CloseCode.ROOM_FULL
    back = here.join(mine, 20.0 + 0.9 * SEAT_KEPT_FOR, "elsewhere")[0].user
    with pytest.raises(RemoteProtocolError, match=r"at most 2; you can"):
        here.join(hello("third"), 35.0, "there")
    here.leave(back, 60.0, lost=True)
    here.join(hello("third"), 60.0 + SEAT_KEPT_FOR, "there")
    with pytest.raises(RemoteProtocolError):
        here.join(mine, 60.0 + SEAT_KEPT_FOR, "elsewhere")


def test_who_comes_and_vanishes_by_many_names_keeps_nobody_out(small_balloon: Balloon) -> None:
    here = room(small_balloon, max_users=4)
    for k in range(40):
        now = 0.1 * k
        here.leave(here.join(hello(f"bad{k}"), now, "bad")[0].user, now + 0.05, lost=True)
    for k in range(4):
        here.join(hello(f"good{k}"), 4.0, "good")


def test_who_leaves_is_named_once_with_the_reason(small_balloon: Balloon) -> None:
    here = room(small_balloon)
    user = enter(here, "left")
    assert here.leave(user, 0.0, "bye") == UserLeft(user=user, name="left", reason="bye")
    assert here.leave(user, 0.0, "bye") is None


@given(st.lists(st.tuples(st.sampled_from("abc"), st.booleans()), max_size=30))
def test_numbers_are_never_used_twice(
    small_balloon: Balloon, happenings: list[tuple[str, bool]]
) -> None:
    here, given_out = room(small_balloon), list[int]()
    holders: dict[str, int] = {}
    for name, comes in happenings:
        if comes and name not in holders:
            holders[name] = enter(here, name)
            given_out.append(holders[name])
        elif not comes and name in holders:
            here.leave(holders.pop(name), 0.0)
    assert len(set(given_out)) == len(given_out)
    assert set(here.members) == set(holders.values())


def test_a_patch_comes_for_each_user_from_its_first_sample_on(small_balloon: Balloon) -> None:
    here = room(small_balloon)
    left, right = enter(here, "left"), enter(here, "right")
    assert here.tick(0.0) == {}
    here.sample(left, sample(5), 0.01)
    patches = here.tick(0.02)
    assert set(patches) == {left}
    assert patches[left].seq == 5
    assert patches[left].sample_wait == pytest.approx(0.01)
    here.sample(right, sample(1), 0.03)
    assert set(here.tick(0.04)) == {left, right}
    here.leave(left, 0.0)
    assert set(here.tick(0.06)) == {right}


def test_the_newest_sample_replaces_the_last(small_balloon: Balloon) -> None:
    here = room(small_balloon)
    user = enter(here, "left")
    for seq in (1, 2, 9):
        made = sample(seq, probe=(0.09, 0.001 * seq, 0.0))._replace(t_client=0.001 * seq)
        here.sample(user, made, 0.001 * seq)
    patch = here.tick(0.01)[user]
    assert patch.seq == 9
    assert patch.t_client == pytest.approx(0.009)


def test_a_hello_speaks_for_the_samples_that_follow(small_balloon: Balloon) -> None:
    """Law and largest force are said once: the body takes no more than the device gives."""
    here = room(small_balloon)
    soft = here.join(hello("soft", law=Law.PROPORTIONAL, max_force=1.0), 0.0)[0].user
    here.sample(soft, sample(force=(5.0, 0.0, 0.0)), 0.0)
    for i in range(30):
        here.tick(i / 60.0)
    patch = here.tick(0.5)[soft]
    assert norm(patch.own_force) == pytest.approx(1.0)
    assert patch.k_h < patch.k_o  # eq. (8)


def test_a_hello_says_what_the_device_may_damp_and_the_room_takes_its_time(
    small_balloon: Balloon,
) -> None:
    """The less it is, the slower the room of two hands that press."""
    lags = list[float]()
    for budget in (FULL_BUDGET, 2.0, 0.0):
        here = room(small_balloon)
        for name, at in (("one", 0.09), ("two", -0.09)):
            asked = hello(name).model_copy(update={"damping_budget": budget})
            user = here.join(asked, 0.0)[0].user
            here.sample(user, sample(probe=(at, 0.0, 0.0), force=(20.0 * at, 0.0, 0.0)), 0.0)
        here.tick(0.01)
        lags.append(here.world.room.lag)
    assert lags == sorted(lags)
    assert lags[0] < 0.6 * lags[1] < lags[1] < lags[2]


def test_the_force_of_a_silent_user_fades_and_the_next_sample_brings_it_back(
    small_balloon: Balloon,
) -> None:
    here, dt = room(small_balloon), 1.0 / 60.0
    user = enter(here, "left")
    now, carried = 0.0, 0.0

    def ticks(seconds: float, *, talking: bool) -> float:
        nonlocal now, carried
        for _ in range(round(seconds / dt)):
            if talking:
                here.sample(user, sample()._replace(tick=here.world.tick), now)
            carried = norm(here.tick(now)[user].own_force)
            now += dt
        return carried

    full = ticks(1.0, talking=True)
    assert full == pytest.approx(2.0, rel=0.01)
    assert ticks(STALE_AFTER - 2 * dt, talking=False) == full  # a hiccup
    assert 0.0 < ticks(RELEASE_TIME, talking=False) < full
    assert ticks(5 * dt, talking=False) == 0.0
    assert ticks(RELEASE_TIME + 2 * dt, talking=True) == pytest.approx(full)


@given(st.lists(st.integers(0, 6), min_size=1, max_size=40))
@settings(max_examples=examples(20), deadline=None)
def test_ticks_count_one_by_one_whatever_happens_between_them(
    small_balloon: Balloon, happenings: list[int]
) -> None:
    here, users = room(small_balloon, max_users=8), list[int]()
    for number, event in enumerate(happenings, start=1):
        now = number / 60.0
        if event == 0 and len(users) < 8:
            users.append(enter(here, f"user{number}", now))
        elif event == 1 and users:
            here.leave(users.pop(0), 0.0)
        elif users:
            here.sample(users[event % len(users)], sample(number), now)
        patches = here.tick(now)
        assert set(patches) <= set(users)
        assert {patch.tick for patch in patches.values()} <= {number}
    assert here.world.tick == len(happenings)


def test_each_user_gets_the_geometry_that_it_asked_for(small_balloon: Balloon) -> None:
    where = room(small_balloon)
    for number, geometry in enumerate(Geometry, start=1):
        asked = hello(str(number)).model_copy(update={"geometry": geometry.name.lower()})
        user = where.join(asked, 0.0)[0].user
        where.sample(user, sample(), 0.0)
    assert [patch.geometry for patch in where.tick(0.01).values()] == list(Geometry)


def test_a_body_with_too_many_vertices_has_no_mesh_patches(
    small_balloon: Balloon, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cohaptic_server.room.body_frames.MAX_VERTICES", 100)
    where = room(small_balloon)
    asked = hello().model_copy(update={"geometry": "mesh"})
    with pytest.raises(RemoteProtocolError, match="plane or sphere: the body has 162 vertices"):
        where.join(asked, 0.0)
    assert where.members == {}
    where.join(hello(), 0.0)


def test_after_a_rest_a_newcomer_begins_as_in_a_room_that_never_rested(
    small_balloon: Balloon,
) -> None:
    """The first tick is one period long, however long nobody was there."""
    fractions = list[float]()
    for rests in (False, True):
        here = room(small_balloon)
        here.tick(0.0)
        if rests:
            here.pass_over(600, 0.0)
        else:
            here.tick(10.0 - 1.0 / 60.0)
        user = enter(here, "ann", 10.0)
        here.sample(user, sample(), 10.0)
        here.tick(10.0)
        fractions.append(float(here.world.users.tracked.presence[0]))
    assert fractions[0] == pytest.approx(fractions[1]) == pytest.approx(1.0 / 60.0 / RELEASE_TIME)
