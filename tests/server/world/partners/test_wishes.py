"""The share of the models, what hands want, and the partners of each patch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.delay import LoopDelay
from cohaptic.control.hand_model import USUAL_HAND, HandModel
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains
from cohaptic.protocol.frame import MAX_FORCE, MAX_POSITION
from cohaptic.protocol.partners import MAX_PARTNERS, Partners
from cohaptic.protocol.patch import Patch
from cohaptic.vec import add
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.bodies.viscous import Viscous
from cohaptic_server.numeric import Floats
from cohaptic_server.world.partners.learning import FIRST_LAG
from cohaptic_server.world.partners.wishes import held_beside, next_wishes, partners_of
from cohaptic_server.world.state import TickTime, Touch, UserState
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import Applied, Forbidden, Tracked, Wishes, WorldState
from tests.server.touches import applied_of, side, touch, tracked_of, user_of
from tests.server.world.worlds import DT, RISE

COARSE = BalloonSettings(subdivisions=2, contact_radius=0.03)
FALL = 1.0 / 3.0  # s in which the share falls from 1 to 0
CALM, RISING = 2.0, 1.0  # s before the share rises, and in which it does
OFTEN = 1e-9
SIZE = 1.0  # m; of a body on which no force of a device makes too deep a dent


def hand(
    user: int, force: float = 2.0, *, deflection: float | None = 0.0, **changes: Any
) -> UserState:
    """A hand whose force the body carries; its client moves models if it tells a deflection."""
    reported = touch(user, at=side(user), force=force, deflection=deflection, **changes)
    return user_of(reported, force=force, requested=force)


class Room:
    """Hands that go on as they are, tick after tick, without a body."""

    def __init__(self, users: Sequence[UserState], *, possible: bool = True) -> None:
        self.set(users)
        self.possible = possible
        self.wishes = Wishes()
        self.time = TickTime(0, 0.0, DT, DT)

    def set(self, users: Sequence[UserState]) -> None:
        self.tracked: Tracked = tracked_of(users)
        self.applied: Applied = applied_of(users)
        n = len(users)
        self.height: Floats = np.zeros(n)
        self.C: Floats = 0.002 * (np.eye(n) + np.ones((n, n)))

    def tick(self) -> Wishes:
        self.time = TickTime(self.time.number + 1, self.time.now + DT, DT, DT)
        self.wishes = next_wishes(
            self.wishes,
            self.tracked,
            self.applied,
            self.height,
            self.C,
            self.tracked.settings[1],
            self.possible,
            self.time,
        )
        return self.wishes

    def run(self, seconds: float) -> list[float]:
        """The share after each tick."""
        return [self.tick().weight for _ in range(math.ceil(seconds / DT))]

    def partners(self, near: Floats | None = None) -> dict[int, Partners]:
        weights = np.ones(len(self.tracked.touches)) if near is None else near
        stiffest = self.tracked.settings[1]
        return partners_of(self.wishes, self.tracked, self.applied, weights, self.C, stiffest, SIZE)


TWO = (hand(1), hand(2))
WITHOUT: dict[str, dict[str, Any]] = {
    "without models": {"deflection": None},
    "with friction": {"friction": True},
    "with the paper's first law": {"law": Law.PROPORTIONAL},
    "with the paper's other law": {"law": Law.PI},
    "with gains of its own": {"fixed_gains": Gains(100.0, 0.0)},
}


@pytest.mark.parametrize("changes", WITHOUT.values(), ids=WITHOUT)
def test_the_share_falls_while_another_hand_presses_and_rises_after_a_calm(
    changes: dict[str, Any],
) -> None:
    room = Room(TWO)
    assert set(room.run(1.0)) == {1.0}
    room.set([*TWO, hand(3, **changes)])
    falling = room.run(FALL)
    assert np.diff([1.0, *falling]) == pytest.approx([-DT / FALL] * len(falling), abs=1e-9)
    assert set(room.run(1.0)) == {0.0}
    room.set([*TWO, hand(3, 0.0, **changes)])  # it lets go
    assert set(room.run(CALM - 2.0 * DT)) == {0.0}
    rising = room.run(RISING + 4.0 * DT)
    assert rising[-1] == 1.0
    assert np.diff(rising).min() >= 0.0
    assert np.diff(rising).max() <= DT / RISING + OFTEN


@pytest.mark.parametrize("changes", WITHOUT.values(), ids=WITHOUT)
def test_a_hand_whose_samples_do_not_count_forbids_nothing(changes: dict[str, Any]) -> None:
    """Its client is silent, or an administrator has muted it: its force only fades."""
    room = Room([*TWO, hand(3, fresh=False, **changes)])
    assert set(room.run(1.0)) == {1.0}


@pytest.mark.parametrize(("pressing", "weight"), [(8, 1.0), (9, 0.0)])
def test_more_hands_than_a_patch_carries_forbid_models(pressing: int, weight: float) -> None:
    room = Room([hand(i + 1, 1.0 if i < pressing else 0.0) for i in range(12)])
    assert room.run(1.0)[-1] == weight


@given(
    st.lists(st.tuples(st.floats(0.0, 10.0), st.floats(-0.05, 0.05)), min_size=1, max_size=5),
    st.integers(0, 2**32 - 1),
)
def test_a_hand_wants_its_depth_and_its_give(hands: list[tuple[float, float]], seed: int) -> None:
    """Its depth below the surface that only the others have moved, plus what they made of it.

    It is no deeper than its device can press, and no farther than 50 mm away.
    """
    rng = np.random.default_rng(seed)
    room = Room([hand(i, f, deflection=y) for i, (f, y) in enumerate(hands, start=1)])
    n = len(hands)
    mixed = rng.standard_normal((n, n))
    room.C, room.height = 0.002 * mixed @ mixed.T, rng.uniform(-0.02, 0.02, n)
    forces = np.array([f for f, _ in hands])
    room.run(1.0)  # the force that is believed grows by 60 N/s
    intended = room.wishes.intended
    for i, (f, y) in enumerate(hands):
        others = sum(room.C[i, j] * forces[j] for j in range(n) if j != i)
        limit = 2.0 * min(10.0, f + 0.5) / USUAL_HAND.stiffness
        deepest = max(room.C[i, i], 1e-4) * 10.0
        depth = min(deepest, max(-0.05, -room.height[i]))
        expected = others + depth + min(limit, max(-limit, y))
        assert intended[i + 1] == pytest.approx(expected, abs=1e-9)


@given(st.floats(-0.01, 0.01), st.integers(1, 30))
def test_what_a_hand_wants_follows_with_its_lag(further: float, ticks: int) -> None:
    room = Room(TWO)
    before = room.tick().intended[1]
    room.height = room.height - [further, 0.0]
    room.run((ticks - 0.5) * DT)
    fraction = 1.0 - math.exp(-ticks * DT / FIRST_LAG)
    assert room.wishes.intended[1] - before == pytest.approx(fraction * further, abs=1e-12)
    assert room.wishes.hands[1].lag == FIRST_LAG


@given(st.floats(-MAX_POSITION, MAX_POSITION), st.floats(0.0, MAX_FORCE))
def test_a_told_give_is_cut_to_what_the_hands_forces_can_do(
    deflection: float, max_force: float
) -> None:
    """In what the hand wants, and in what its partners begin with.

    The forces are those that it told, here 2 N, and half a newton that is still to come.
    """
    room = Room([hand(1), hand(2, deflection=deflection, max_force=max_force)])
    limit = 2.0 * min(max_force, 2.5) / USUAL_HAND.stiffness
    none = Room([hand(1), hand(2, max_force=max_force)])
    for _ in range(9):
        room.tick()
        none.tick()
    assert abs(room.wishes.intended[2] - none.wishes.intended[2]) <= limit + 1e-12
    partner = room.partners()[1].partners[0]
    assert partner.deflection == pytest.approx(min(limit, max(-limit, deflection)), abs=1e-12)


def test_a_patch_has_all_others_and_what_is_between_their_contacts() -> None:
    users = [hand(1, 1.0), hand(2, 3.0, deflection=0.004), hand(3, 2.0, max_force=7.0)]
    room = Room(users)
    room.C = 0.001 * np.array([[4.0, 0.5, 0.25], [0.5, 5.0, -0.125], [0.25, -0.125, 6.0]])
    room.applied = room.applied._replace(presence=np.array([1.0, 1.0, 0.5]))
    room.run(0.2)  # the force that is believed grows by 60 N/s
    wishes = room.wishes
    found = room.partners()
    assert set(found) == {1, 2, 3}
    first = found[1]
    assert (first.weight, first.model, first.users) == (1.0, USUAL_HAND, (2, 3))
    second, third = first.partners
    assert (second.intended, second.deflection, second.force) == (wishes.intended[2], 0.004, 3.0)
    assert (second.max_force, third.max_force) == (4.75, 3.5)  # what it told and more; its own
    assert (second.c_jj, third.c_jj) == pytest.approx((0.005, 0.006), rel=2e-5)
    assert second.coupled == (0.0005,)
    assert third.coupled == (0.00025, -0.000125)
    assert found[2].users == (1, 3)
    assert found[2].partners[1].coupled == (-0.000125, 0.00025)


def test_a_device_softer_than_the_body_is_what_yields() -> None:
    room = Room([hand(1), hand(2, max_stiffness=50.0)])
    room.tick()
    assert room.partners()[1].partners[0].c_jj == pytest.approx(0.02, rel=2e-5)


def test_who_is_out_of_reach_is_no_partner_and_most_pressing_ones_come_first() -> None:
    room = Room([hand(i + 1, float(i % 5)) for i in range(12)])
    room.tick()
    near = np.ones(12)
    near[9] = 0.0  # it presses with 4 N no more, and has gone
    for user, found in room.partners(near).items():
        assert len(found.partners) == MAX_PARTNERS
        assert not {user, 10} & set(found.users)
        # Those who press most, each at the place of its row.
        assert list(found.users) == sorted(found.users)
        others = sorted([float(i % 5) for i in range(12) if i + 1 not in (user, 10)], reverse=True)
        assert sorted([p.force for p in found.partners], reverse=True) == others[:MAX_PARTNERS]


def test_models_are_those_that_a_client_had_when_it_answered() -> None:
    """The deflection that it told is that of this model; the model has moved on since."""
    room = Room(TWO)
    room.run(0.5)
    other = HandModel(0.3, 4.0, 200.0)
    learned = {u: replace(h, wanted=(other, h.lag)) for u, h in room.wishes.hands.items()}
    room.wishes = replace(room.wishes, hands=learned)
    models = {room.time.number: room.wishes.hands[2].model}
    for _ in range(40):
        room.tick()
        models[room.time.number] = room.wishes.hands[2].model
    assert len(set(models.values())) > 30
    for answered in (room.time.number, room.time.number - 7, room.time.number - 39):
        room.set([hand(1), hand(2, tick=answered)])
        assert room.partners()[1].partners[0].model == models[answered]
        assert room.partners()[2].model == models[room.time.number]


FIRM = HandModel(0.15, 60.0, 1e4)


def simulated(user: int, force: float = 2.0, **changes: Any) -> UserState:
    """A hand that its client, as the page, simulates and tells; it moves no models of others."""
    return hand(user, force, own_model=changes.pop("own_model", USUAL_HAND), **changes)


def test_a_simulated_hand_is_a_partner_at_once_and_has_none_itself() -> None:
    room = Room([hand(1), simulated(2, deflection=0.004)])
    assert set(room.run(5.0)) == {1.0}
    found = room.partners()
    assert set(found) == {1}
    partner = found[1].partners[0]
    assert (partner.user, partner.model, partner.deflection) == (2, USUAL_HAND, 0.004)
    assert room.wishes.forbidden.users == ()


def test_models_follow_a_simulated_hand_that_changes_no_faster_than_clients_let_them() -> None:
    """By a factor of e in a second; until then a deflection presses no more than reported."""
    room = Room([hand(1), simulated(2)])
    room.run(0.5)
    room.set([hand(1), simulated(2, own_model=FIRM, deflection=1.0)])
    models = list[HandModel]()
    for _ in range(round(math.log(25.0) / DT) + 2):
        room.tick()
        partner = room.partners()[1].partners[0]
        models.append(partner.model)
        assert partner.deflection == pytest.approx(2.0 * 2.5 / FIRM.stiffness)
    k = np.array([USUAL_HAND.stiffness, *[model.stiffness for model in models]])
    assert models[-1] == FIRM
    assert np.diff(np.log(k)).max() <= 1.01 * DT
    room.set([hand(1), simulated(2, deflection=1.0)])
    room.tick()
    last = room.partners()[1].partners[0]
    assert last.deflection <= 2.0 * 2.5 / last.model.stiffness


def test_a_model_presses_no_harder_than_its_hand_has_told() -> None:
    """Such as one whose force is off after a fault, however deep it is."""
    for one in (hand(2, 0.0), simulated(2, 0.0)):
        room = Room([hand(1), one])
        room.height = np.array([0.0, -0.03])
        room.tick()
        assert room.partners()[1].partners[0].max_force == 1.0


def test_a_hand_that_was_silent_comes_back_with_a_model_as_weak_as_its_force() -> None:
    room = Room(TWO)
    room.run(1.0)
    assert room.partners()[1].partners[0].max_force == 3.5
    room.set([hand(1), hand(2, fresh=False)])  # its force fades, though it has told 2 N last
    room.run(5.0)
    room.set([hand(1), hand(2, 0.1)])
    room.tick()
    assert room.partners()[1].partners[0].max_force < 1.25


def test_only_who_moves_models_has_a_contact_that_the_others_stiffen() -> None:
    room = Room([hand(1), simulated(2)])
    room.tick()
    pressing = np.array([True, True])
    beside = held_beside(room.tracked, room.wishes, pressing, room.C)
    assert beside[0] == pytest.approx(0.002**2 / 0.004, rel=1e-3)
    assert beside[1] == 0.0


def test_a_model_presses_with_no_force_along_the_surface() -> None:
    aside = touch(2, at=side(2), deflection=0.0, force=0.1)
    slid = replace(aside, force=add(aside.force, (0.0, 0.0, 8.0)))
    rooms = [Room([hand(1), user_of(one, force=0.1, requested=0.1)]) for one in (aside, slid)]
    for room in rooms:
        room.tick()
    straight, along = [room.partners()[1].partners[0].max_force for room in rooms]
    assert along == straight < 2.0


@pytest.mark.parametrize(("into", "along", "doubted"), [(9.0, 0.0, 0.0), (0.1, 8.0, 0.32)])
def test_a_deep_hand_is_believed_for_a_force_into_the_object_alone(
    into: float, along: float, doubted: float
) -> None:
    reported = touch(2, at=side(2), deflection=0.0, force=into)
    reported = replace(reported, force=add(reported.force, (0.0, 0.0, along)))
    room = Room([hand(1), user_of(reported, force=into, requested=into)])
    room.height[1] = -0.03
    assert room.tick().hands[2].doubted == doubted


def late(user: UserState, *delays: float) -> UserState:
    """The same user, whose loop had these delays in turn for three seconds [s]."""
    loop = LoopDelay()
    for k in range(180):
        loop = loop.measured(delays[k // 6 % len(delays)], DT * k, DT)
    # Its newest sample answers the newest patch, whichever that is.
    return replace(user, delay=loop, touch=replace(user.touch, tick=10**6))


def test_a_hand_that_is_silent_forbids_models_when_it_comes_back() -> None:
    room = Room(TWO)
    room.run(1.0)
    varied = late(hand(1), 0.02, 0.3)
    room.set([replace(varied, touch=replace(varied.touch, tick=0)), hand(2)])
    assert set(room.run(1.0)) == {1.0}
    room.set([varied, hand(2)])
    assert room.run(FALL + 2.0 * DT)[-1] == 0.0


@pytest.mark.parametrize(
    ("users", "possible", "reason"),
    [
        (
            [late(hand(1), 0.02, 0.3), hand(2), late(hand(3), 0.5, 0.0)],
            True,
            Forbidden("link", (1, 3)),
        ),
        ([late(hand(1), 0.02, 0.3), hand(2, deflection=None)], True, Forbidden("hand", (2,))),
        (
            [hand(1), hand(2, deflection=None), hand(3, friction=True)],
            True,
            Forbidden("hand", (2, 3)),
        ),
        ([hand(i + 1) for i in range(9)], True, Forbidden("number")),
        ([hand(1), hand(2, deflection=None)], False, Forbidden("object")),
    ],
)
def test_it_is_known_why_models_are_forbidden(
    users: list[UserState], possible: bool, reason: Forbidden
) -> None:
    room = Room(users, possible=possible)
    room.run(0.5)
    assert room.wishes.forbidden == reason
    room.set(TWO)
    room.possible = True
    room.run(1.0)  # the share is below 1 for the same reason still
    assert (room.wishes.forbidden, room.wishes.weight) == (reason, 0.0)


wild = st.floats(-1e6, 1e6)


@given(
    st.lists(
        st.tuples(
            st.floats(0.0, 1e4), st.floats(-MAX_POSITION, MAX_POSITION),
            st.floats(0.0, MAX_FORCE), st.floats(1.0, 1e6), wild,
        ),
        min_size=1, max_size=10,
    ),
    st.data(),
)  # fmt: skip
def test_every_patch_can_be_sent_whatever_hands_tell_and_bodies_do(
    hands: list[tuple[float, float, float, float, float]], data: st.DataObject
) -> None:
    room = Room(
        [
            hand(i, f, deflection=y, max_force=max_force, max_stiffness=k)
            for i, (f, y, max_force, k, _) in enumerate(hands, start=1)
        ]
    )
    n = len(hands)
    row = data.draw(st.lists(wild, min_size=n * n, max_size=n * n))
    room.C, room.height = np.array(row).reshape(n, n), np.array([h[-1] for h in hands])
    for _ in range(3):
        room.tick()
    for found in room.partners().values():
        found.encode()


def held(
    body: Body, touches: Sequence[Touch], seconds: float
) -> tuple[WorldState, dict[int, Patch]]:
    state, patches, touched = WorldState(), dict[int, Patch](), TouchedBody(body)
    for tick in range(math.ceil(seconds / DT)):
        now = tick * DT
        moved = [replace(t, t_client=now, arrived=now, tick=max(0, tick - 1)) for t in touches]
        state, patches = advance(touched, state, moved, now=now, dt=DT)
    return state, patches


def both(**changes: Any) -> list[Touch]:
    return [touch(i, at=side(math.pi * i), deflection=0.0, **changes) for i in (1, 2)]


@pytest.mark.parametrize("body", ["rubber", "viscous", "balloon"])
def test_bodies_that_do_not_superpose_forbid_models(body: str, small_balloon: Balloon) -> None:
    made: dict[str, Body] = {
        "rubber": RubberBalloon(COARSE),
        "viscous": Viscous(Balloon(COARSE), 2.0),
        "balloon": small_balloon,
    }
    state, patches = held(made[body], both(), 0.6)
    weight = 1.0 if body == "balloon" else 0.0
    assert state.wishes.weight == weight
    assert patches[1].partners is not None
    assert patches[1].partners.weight == weight


def test_steep_contacts_forbid_models(small_balloon: Balloon) -> None:
    state, _ = held(small_balloon, both(depth=0.06), RISE * DT + 0.6)
    assert state.users[1].contact.slope < 0.75
    assert state.wishes.weight == 0.0
