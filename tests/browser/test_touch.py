"""Hands in pages feel each other, and hands that are no pages, by as much as the body says.

A hand that holds still is a spring; where it wants to be follows from where its tip is and from the
force on it. Body and springs in equilibrium, solved without any network, are the truth.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import pytest

from cohaptic.protocol.scene_users import UserRecord
from cohaptic.simulated.hand import Hand
from cohaptic.vec import add, scale
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.world.equilibrium import RestingHand, solve
from tests.browser.conftest import Open
from tests.browser.room import Room, Users
from tests.browser.visitor import AZIMUTH, CLOCK, LONG, Visitor

pytestmark = pytest.mark.live

K = Hand().stiffness  # N/m; the hand in a page is the same (web/src/page/own_hand.ts)
# What is shown has two digits; a hand that counts as steady still creeps by as much.
SHARE, LEAST = 0.03, 0.03
NEAR = 1e-4  # m; a hand at rest does not move by more


def spring(user: UserRecord) -> RestingHand:
    """The hand behind a tip that rests."""
    return RestingHand(add(user.probe, scale(user.force, -1.0 / K)), K)


def at_rest(room: Room) -> Users:
    """Those on the body once nobody has moved for a while, as the server has them."""
    since, looks, before = CLOCK.now(), 0, Users()

    def rest(users: Users) -> bool:
        nonlocal since, looks, before
        looks += 1
        if users.keys() != before.keys() or any(
            math.dist(user.force, before[number].force) > LEAST
            or math.dist(user.probe, before[number].probe) > NEAR
            for number, user in users.items()
        ):
            since, looks, before = CLOCK.now(), 0, users
        return looks > 2 and CLOCK.now() - since > LONG  # also where the server stood still

    return room.until(rest, "all hands to rest")


def known(visitor: Visitor, read: Callable[[], float]) -> float:
    """A number once it is shown: there is none while a busy server is silent."""
    seen = [math.nan]

    def shown() -> bool:
        seen[0] = read()
        return not math.isnan(seen[0])

    visitor.until(shown, "a number")
    return seen[0]


def _shows(visitor: Visitor, felt: object) -> bool:
    return visitor.from_others == felt


def test_two_pages_feel_each_other(visitors: Open, room: Room, body: Balloon) -> None:
    ann, bob = visitors(), visitors()
    for visitor in (ann, bob):
        visitor.visit(room.address)
    # From two sides: what one presses out, the other feels.
    ann.turn(-math.pi - AZIMUTH)
    bob.turn(-AZIMUTH)
    ann.take_part("ann")
    ann.press()
    alone = ann.steady_force()
    (first,) = at_rest(room).values()
    assert known(ann, lambda: ann.from_others) == pytest.approx(0.0, abs=LEAST)

    bob.take_part("bob")
    bob.press()
    bob.steady_force()
    (second,) = (user for number, user in at_rest(room).items() if number != first.user)
    together, bobs = ann.steady_force(), bob.steady_force()
    hands = [spring(first), spring(second)]
    (before,) = solve(body, hands[:1]).force
    truth = solve(body, hands)
    assert truth.felt_from_others.min() > 0.5
    assert alone == pytest.approx(before, rel=SHARE, abs=LEAST)
    assert together == pytest.approx(truth.force[0], rel=SHARE, abs=LEAST)
    assert bobs == pytest.approx(truth.force[1], rel=SHARE, abs=LEAST)
    for visitor, felt in zip((ann, bob), truth.felt_from_others, strict=True):
        # A page that draws seldom beside others shows it later than the own force.
        near = pytest.approx(felt, rel=SHARE, abs=LEAST)
        visitor.until(partial(_shows, visitor, near), f"{felt:.3f} N from the other")
    # Each page shows the other's force too.
    assert known(ann, lambda: ann.force_of("bob")) == pytest.approx(bobs, abs=LEAST)
    assert known(bob, lambda: bob.force_of("ann")) == pytest.approx(together, abs=LEAST)

    bob.release()
    bob.until(lambda: not bob.force > 0.0, "bob to let go")
    assert ann.steady_force() == pytest.approx(before, rel=SHARE, abs=LEAST)


def test_a_page_and_a_native_hand_feel_each_other(
    visitors: Open, room: Room, body: Balloon
) -> None:
    ann = visitors()
    ann.visit(room.address)
    ann.turn(-math.pi - AZIMUTH)
    ann.take_part("ann")
    ann.press()
    alone = ann.steady_force()
    (first,) = at_rest(room).values()
    with room.hand("native", "--angle", "0", "--geometry", "sphere") as native:
        ann.until(lambda: native.status.felt_from_others > 0.5, "the native hand to feel ann")
        (second,) = (user for number, user in at_rest(room).items() if number != first.user)
        together = ann.steady_force()
        hands = [spring(first), spring(second)]
        truth = solve(body, hands)
        assert alone == pytest.approx(solve(body, hands[:1]).force[0], rel=SHARE, abs=LEAST)
        assert together == pytest.approx(truth.force[0], rel=SHARE, abs=LEAST)

        def as_the_body_says() -> bool:
            # Its newest word may still be one of its way in.
            felt = native.status
            return (felt.force, felt.felt_from_others) == pytest.approx(
                (truth.force[1], truth.felt_from_others[1]), rel=SHARE, abs=LEAST
            )

        ann.until(as_the_body_says, f"the native hand to feel {truth.force[1]:.3f} N")
        felt = native.status.force
        assert known(ann, lambda: ann.force_of("native")) == pytest.approx(felt, abs=LEAST)

        ann.release()
        ann.until(
            lambda: abs(native.status.felt_from_others) < LEAST, "the native hand to be alone"
        )
        (rest,) = solve(body, hands[1:]).force
        # Nothing comes from ann any more, and the hand's own spring still takes it back.
        ann.until(
            lambda: native.status.force == pytest.approx(rest, rel=SHARE, abs=LEAST),
            "the force of one who is alone",
        )
        assert abs(native.status.felt_from_others) < LEAST
