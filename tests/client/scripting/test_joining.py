"""Hands of scripts at a real server, on real clocks."""

from __future__ import annotations

import asyncio
import math
import socket
import threading
from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise

import pytest

from cohaptic.errors import CohapticError, DeviceError, ServerLost, SettingError
from cohaptic.vec import Vec3, norm
from cohaptic_client import Client, ClientSettings, Contact, DeviceSample, LiveHand, join, joined
from cohaptic_server import ServedRoom, serve

pytestmark = pytest.mark.live


@pytest.fixture(scope="module")
def room() -> Iterator[ServedRoom]:
    with serve("balloon", port=0, max_users=4) as served:
        yield served


def wait_until(hand: LiveHand, holds: Callable[[], bool]) -> None:
    """Take samples until something holds; the test's own limit ends what never does."""
    for _ in hand.samples():
        if holds():
            return
    pytest.fail("the hand was lost")


def press(hand: LiveHand, depth: float = 0.01) -> None:
    x, y, z = hand.body.center
    hand.move_to((x + hand.body.radius - depth, y, z), 0.3)


def test_a_script_presses_and_asks_why(room: ServedRoom) -> None:
    with joined(room.url, name="ann") as hand:
        press(hand)
        wait_until(hand, lambda: hand.force[0] > 2.0)
        why = hand.why
        assert sum(entry.newtons for entry in why.entries) == pytest.approx(why.force, abs=1e-6)
        assert why.force > 2.0
        assert "by the surface" in why.sentence
        assert hand.patch.k_o > 0.0
        wait_until(hand, lambda: hand.status.state == "touching")
        assert [user.name for user in room.users] == ["ann"]
        assert [event.kind for event in hand.events.new()] == ["touching"]
    assert [user.name for user in room.users] == []
    assert norm(hand.force) == 0.0  # the last period let go


def test_every_sample_comes_once_and_in_order(room: ServedRoom) -> None:
    with joined(room.url, name="ann") as hand:
        samples = hand.samples()
        rows = [next(samples) for _ in range(1500)]
    for a, b in pairwise(rows):
        # A period is due 1 ms after the one before; the loop skips as many as that was late.
        due = (b.t - b.late) - (a.t - a.late)
        assert round(1e3 * due) == 1 + int(1e3 * a.late)
    assert samples.lost == 0
    rest = list(samples)  # the stream ends with the hand
    assert rest == sorted(rest)


def test_two_hands_see_and_feel_each_other(room: ServedRoom) -> None:
    async def meet() -> None:
        async with (
            join(room.url, name="ann") as ann,
            join(room.url, name="bob", tip=(-0.13, 0.0, 0.0)) as bob,
        ):
            press(ann)
            seen = False
            async for _ in bob.samples():
                other = next((one for one in bob.others if one.name == "ann"), None)
                if other is not None and other.force is not None and other.force[0] > 2.0:
                    seen = True
                    break
            assert seen
            assert {event.kind for event in ann.events.new()} == {"touching", "user"}

    asyncio.run(asyncio.wait_for(meet(), 120.0))


class Dipping:
    """A device of a script: a tip that goes into the balloon and stays there."""

    def __init__(self) -> None:
        self.begun: float | None = None

    def read(self, now: float) -> DeviceSample:
        if self.begun is None:
            self.begun = now
        depth = min(0.01, 0.01 * max(0.0, now - self.begun - 1.0))
        return DeviceSample((0.101 - depth, 0.0, 0.0), (0.0, 0.0, 0.0))

    def write(self, force: Vec3) -> None:
        if norm(force) > 1.5:
            raise DeviceError("dipping", "it was pressed hard", "press it gently")


def test_a_device_of_a_script_lives_in_the_loops_process_and_its_error_comes_back(
    room: ServedRoom,
) -> None:
    def touch() -> None:
        with joined(room.url, name="ann", device=Dipping) as hand:
            with pytest.raises(SettingError, match="moved by the device"):
                hand.tip = (0.0, 0.0, 0.0)
            assert max(norm(sample.force) for sample in hand.samples()) > 1.0
            with pytest.raises(DeviceError):
                _ = hand.force

    with pytest.raises(DeviceError, match="pressed hard"):
        touch()


class Broken:
    """A device of a script that is at the right of the balloon for a while, and then fails."""

    def __init__(self, fails: Callable[[], Vec3]) -> None:
        self.count, self.fails = 0, fails

    def read(self, now: float) -> DeviceSample:
        self.count += 1
        place = (0.12, 0.0, 0.0) if self.count < 2000 else self.fails()
        return DeviceSample(place, (0.0, 0.0, 0.0))

    def write(self, force: Vec3) -> None:
        pass


def is_nowhere() -> Vec3:
    return (math.nan, 0.0, 0.0)


def is_far_away() -> Vec3:
    return (1000.0, 0.0, 0.0)


def takes_its_time() -> Vec3:
    threading.Event().wait(0.05)
    return (0.12, 0.0, 0.0)


@pytest.mark.parametrize(
    ("fails", "words"),
    [
        (is_nowhere, "the device is at (nan, 0.0, 0.0) m"),
        (is_far_away, "the device is at (1000.0, 0.0, 0.0) m"),
        (takes_its_time, "since read or write of"),
    ],
)
def test_a_device_that_fails_is_a_fault_that_names_it_and_the_hand_stays(
    room: ServedRoom, fails: Callable[[], Vec3], words: str
) -> None:
    with joined(room.url, name="ann", device=partial(Broken, fails)) as hand:
        samples = hand.samples()
        said = next(news for _ in samples for news in hand.events.new() if news.kind == "fault")
        assert words in said
        for _ in range(100):
            assert norm(next(samples).force) == 0.0


def test_a_way_through_the_body_is_told(room: ServedRoom) -> None:
    with joined(room.url, name="ann") as hand:
        x, y, z = hand.body.center
        press(hand)
        assert "device" not in [event.kind for event in hand.events.new()]
        hand.move_to((x + hand.body.radius + 0.02, y, z), 0.1)
        wait_until(hand, lambda: hand.tip[0] > x + hand.body.radius + 0.01)
        assert "device" not in [event.kind for event in hand.events.new()]
        hand.move_to((x - hand.body.radius - 0.02, y, z), 1.0)
        told = [str(event) for event in hand.events.new() if event.kind == "device"]
        assert len(told) == 1
        assert "near the middle of the body" in told[0]
        hand.move_to((x + hand.body.radius + 0.02, y, z), 1.0)
        assert "device" not in [event.kind for event in hand.events.new()]


def test_where_nobody_answers_the_end_of_the_duration_is_an_error() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    url = f"ws://127.0.0.1:{port}"
    settings = ClientSettings(url, "ann", duration=0.5, patience=30.0)
    with pytest.raises(ServerLost, match="no server answers"):
        asyncio.run(Client(settings, tell=lambda news: None, keep=None).run())


class Half:
    name = "half"
    reason = "half of the force"
    is_law = False

    def begin(self) -> int:
        return 0

    def apply(self, memory: int, contact: Contact) -> int:
        x, y, z = contact.force
        contact.force = (0.5 * x, 0.5 * y, 0.5 * z)
        return memory


def test_a_rule_of_a_script_is_in_the_ledger(room: ServedRoom) -> None:
    with joined(room.url, name="ann", rules=[Half()]) as hand:
        press(hand)
        wait_until(hand, lambda: hand.force[0] > 1.0)
        entries = {entry.name: entry.newtons for entry in hand.why.entries}
        assert entries["half"] == pytest.approx(-0.5 * entries["surface"], rel=0.2)
        assert "half" in hand.status.ledger


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"name": ""}, "name"),
        ({"law": "magic"}, "proportional, pi, predictive"),
        ({"network": "carrier pigeon"}, "wifi"),
        ({"device": "hoover"}, "simulated"),
        ({"rules": [Half]}, "instance"),
        ({"max_force": -1.0}, "max force"),
    ],
)
def test_a_wrong_value_is_an_error_before_anything_starts(
    options: dict[str, object], error: str
) -> None:
    with pytest.raises(CohapticError, match=error), joined("ws://127.0.0.1:9", **options):
        pytest.fail("it joined")


def test_a_room_that_ends_is_an_error_at_the_end_of_the_block_and_in_it() -> None:
    served = serve("balloon", port=0)

    def touch() -> None:
        once = ClientSettings(served.url, "ann", patience=0.0)
        with joined(served.url, name="ann", settings=once) as hand:
            served.__exit__(None, None, None)
            for _ in hand.samples():  # until the hand is lost
                pass
            with pytest.raises(ServerLost):
                hand.move_to((0.0, 0.0, 0.0), 1.0)

    served.__enter__()
    with pytest.raises(ServerLost):
        touch()


def test_a_server_that_comes_back_is_touched_again_and_no_attribute_fails_meanwhile() -> None:
    first = serve("balloon", port=0)
    first.__enter__()
    port = int(first.url.rpartition(":")[2])
    with joined(first.url, name="ann", tip=(0.13, 0.0, 0.0)) as hand:
        first.__exit__(None, None, None)
        events = hand.events
        while next(events).kind != "server":  # it is lost, and tried again
            pass
        assert (hand.patch.tick > 0, hand.body.name, hand.others) == (True, "balloon", ())
        with serve("balloon", port=port):
            while next(events).kind != "touching":
                pass
            press(hand)
            wait_until(hand, lambda: hand.force[0] > 1.0)
            wait_until(hand, lambda: hand.status.state == "touching")


def test_who_may_not_watch_touches_all_the_same_and_does_not_ask_again() -> None:
    with serve("balloon", port=0, max_watchers=0) as room:
        with (
            joined(room.url, name="ann") as ann,
            joined(room.url, name="bob", tip=(-0.13, 0.0, 0.0)),
        ):
            press(ann)
            wait_until(ann, lambda: ann.force[0] > 1.0 and len(ann.others) == 1)
            assert [(other.name, other.tip) for other in ann.others] == [("bob", None)]
            kinds = [event.kind for event in ann.events.new()]
            assert kinds.count("room") == 1


def test_a_hand_that_has_left_says_so(room: ServedRoom) -> None:
    with joined(room.url, name="ann") as hand:
        pass
    with pytest.raises(ServerLost, match="has left"):
        hand.tip = (0.0, 0.0, 0.0)
    assert list(hand.samples()) == []


def test_a_duration_that_is_over_too_soon_is_an_error(room: ServedRoom) -> None:
    short = ClientSettings(room.url, "ann", duration=1e-6)
    with (
        pytest.raises(ServerLost, match="before the hand felt"),
        joined(room.url, name="ann", settings=short),
    ):
        pytest.fail("it felt something")
