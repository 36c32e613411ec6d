"""Hands in pages feel each other, and hands that are no pages, by as much as the body says.

A hand that holds still is a spring; where it wants to be follows from where its tip is and from the
force on it. Body and springs in equilibrium, solved without any network, are the truth.
"""

from __future__ import annotations

import math

import pytest

from cohaptic.protocol.scene import UserRecord
from cohaptic.simulated.hand import Hand
from cohaptic.vec import add, scale
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.world.equilibrium import RestingHand, solve
from tests.browser.conftest import Open
from tests.browser.room import Room
from tests.browser.visitor import AZIMUTH

pytestmark = pytest.mark.patient

K = Hand().stiffness  # N/m; the hand in a page is the same (web/src/page/own_hand.ts)
# What is shown has two digits; a hand that counts as steady still creeps by as much.
SHARE, LEAST = 0.03, 0.03


def spring(user: UserRecord) -> RestingHand:
    """The hand behind a tip that rests."""
    return RestingHand(add(user.probe, scale(user.force, -1.0 / K)), K)


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
    ((_, first),) = room.users().items()
    assert ann.from_others == pytest.approx(0.0, abs=LEAST)

    bob.take_part("bob")
    bob.press()
    bob.steady_force()
    together = ann.steady_force()
    (second,) = (user for number, user in room.users().items() if number != first.user)
    hands = [spring(first), spring(second)]
    (before,) = solve(body, hands[:1]).force
    truth = solve(body, hands)
    assert truth.felt_from_others.min() > 0.5
    assert alone == pytest.approx(before, rel=SHARE, abs=LEAST)
    assert together == pytest.approx(truth.force[0], rel=SHARE, abs=LEAST)
    assert bob.force == pytest.approx(truth.force[1], rel=SHARE, abs=LEAST)
    assert ann.from_others == pytest.approx(truth.felt_from_others[0], rel=SHARE, abs=LEAST)
    assert bob.from_others == pytest.approx(truth.felt_from_others[1], rel=SHARE, abs=LEAST)
    # Each page shows the other's force too.
    assert ann.force_of("bob") == pytest.approx(bob.force, abs=LEAST)
    assert bob.force_of("ann") == pytest.approx(ann.force, abs=LEAST)

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
    ((_, first),) = room.users().items()
    with room.hand("native", "--angle", "0", "--geometry", "sphere") as native:
        ann.until(lambda: native.status.felt_from_others > 0.5, "the native hand to feel ann")
        together = ann.steady_force()
        (second,) = (user for number, user in room.users().items() if number != first.user)
        hands = [spring(first), spring(second)]
        truth = solve(body, hands)
        assert alone == pytest.approx(solve(body, hands[:1]).force[0], rel=SHARE, abs=LEAST)
        assert together == pytest.approx(truth.force[0], rel=SHARE, abs=LEAST)
        felt = native.status
        assert felt.force == pytest.approx(truth.force[1], rel=SHARE, abs=LEAST)
        assert felt.felt_from_others == pytest.approx(
            truth.felt_from_others[1], rel=SHARE, abs=LEAST
        )
        assert ann.force_of("native") == pytest.approx(felt.force, abs=LEAST)

        ann.release()
        ann.until(
            lambda: abs(native.status.felt_from_others) < LEAST, "the native hand to be alone"
        )
        (rest,) = solve(body, hands[1:]).force
        assert native.status.force == pytest.approx(rest, rel=SHARE, abs=LEAST)
