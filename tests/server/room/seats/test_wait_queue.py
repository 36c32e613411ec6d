"""Laws of the queue before a full room."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic_server.room.seats.wait_queue import MISSED_FOR, TURN, WaitQueue

LARGEST, OF_SOURCE, SEATS = 6, 2, 3


class Queueing(RuleBasedStateMachine):
    """A room of three seats, addresses that come as often as they like, and people who vanish."""

    def __init__(self) -> None:
        super().__init__()
        self.queue = WaitQueue(LARGEST, OF_SOURCE)
        self.order: list[int] = []  # who waits, as it should be
        self.seated: set[int] = set()
        self.called: dict[int, float] = {}
        self.now, self.next = 0.0, 1
        self.source: dict[int, str] = {}
        self.missed: list[tuple[str, float]] = []

    @rule(source=st.sampled_from("abcde"))
    def come_by(self, source: str) -> None:
        number, before = self.next, self.queue
        self.next += 1
        of_source = sum(p.source == source for p in before.places)
        try:
            self.queue = before.enter(number, source, self.now)
        except RemoteProtocolError:
            assert len(before) == LARGEST or of_source + self.lost(source) >= OF_SOURCE
            return
        assert len(before) < LARGEST
        assert of_source + self.lost(source) < OF_SOURCE
        self.order.append(number)
        self.source[number] = source

    def lost(self, source: str) -> int:
        """Places that an address has less, for the turns that were missed there."""
        return sum(one == source and until > self.now for one, until in self.missed)

    def miss(self, number: int) -> None:
        self.queue = self.queue.leave(number, self.now)
        self.order.remove(number)
        if self.called.pop(number, None) is not None:
            self.missed.append((self.source[number], self.now + MISSED_FOR))

    @rule()
    def call(self) -> None:
        free = SEATS - len(self.seated)
        self.queue, called = self.queue.call(free, self.now)
        waiting = [n for n in self.order if n not in self.called]
        # The first who wait, as many as there are seats that nobody was called to.
        assert list(called) == waiting[: max(0, free - len(self.called))]
        self.called |= dict.fromkeys(called, self.now + TURN)

    @precondition(lambda self: self.called)
    @rule(data=st.data())
    def come_in(self, data: st.DataObject) -> None:
        number = data.draw(st.sampled_from(sorted(self.called)))
        self.queue = self.queue.come(number)
        self.seated.add(number)
        self.order.remove(number)
        del self.called[number]

    @precondition(lambda self: self.order)
    @rule(data=st.data())
    def give_up(self, data: st.DataObject) -> None:
        self.miss(data.draw(st.sampled_from(self.order)))

    @precondition(lambda self: self.seated)
    @rule(data=st.data())
    def stand_up(self, data: st.DataObject) -> None:
        self.seated.remove(data.draw(st.sampled_from(sorted(self.seated))))

    @rule(seconds=st.sampled_from([0.5 * TURN, TURN, 0.5 * MISSED_FOR, MISSED_FOR]))
    def wait(self, seconds: float) -> None:
        self.now += seconds
        late = self.queue.late(self.now)
        assert set(late) == {n for n, until in self.called.items() if until <= self.now}
        for number in late:
            self.miss(number)

    @invariant()
    def it_is_bounded_in_order_and_seats_nobody_twice(self) -> None:
        assert [p.number for p in self.queue.places] == self.order
        assert len(self.queue) <= LARGEST
        assert self.queue.called == len(self.called)
        assert len(self.seated) + self.queue.called <= SEATS
        waiting = [n for n in self.order if n not in self.called]
        reported = {n: (k + 1, len(waiting)) for k, n in enumerate(waiting)}
        assert self.queue.ranks() == reported


TestQueueing = Queueing.TestCase


@given(st.lists(st.sampled_from("abc"), max_size=20))
def test_one_address_leaves_places_for_others(sources: list[str]) -> None:
    queue = WaitQueue(LARGEST, OF_SOURCE)
    for number in range(50):
        if number < 40:
            source = "hostile"
        else:
            source = sources[number % len(sources)] if sources else "hostile"
        try:
            queue = queue.enter(number, source, 0.0)
        except RemoteProtocolError:
            continue
    assert len(queue) <= LARGEST
    assert sum(p.source == "hostile" for p in queue.places) == OF_SOURCE
    if sources:
        assert any(p.source != "hostile" for p in queue.places)


def test_a_queue_without_places_takes_nobody() -> None:
    with pytest.raises(RemoteProtocolError, match="is 1; expected at most 0") as caught:
        WaitQueue(0, 4).enter(1, "a", 0.0)
    assert caught.value.code is CloseCode.ROOM_FULL


def test_another_connection_takes_the_place_over() -> None:
    queue = WaitQueue(3, 3).enter(1, "a", 0.0).enter(2, "b", 0.0).enter(3, "c", 0.0)
    queue = queue.hand_on(2, 7)
    assert queue.ranks() == {1: (1, 3), 7: (2, 3), 3: (3, 3)}
    assert 2 not in queue
    assert queue.hand_on(99, 5) == queue
    assert queue.leave(99, 0.0) == queue


def test_nobody_is_called_while_fewer_seats_are_there_than_were_promised() -> None:
    queue, called = WaitQueue(3, 3).enter(1, "a", 0.0).enter(2, "b", 0.0).call(1, 0.0)
    assert called == (1,)
    assert queue.call(-3, 0.0) == (queue, ())
    assert queue.call(1, 0.0) == (queue, ())
    with pytest.raises(ValueError, match="1 waits already"):
        queue.enter(1, "a", 0.0)


def test_addresses_that_never_take_a_seat_do_not_hold_the_queue() -> None:
    """Four of them fill it, leave when they are called, and come back at once."""
    queue, guest = WaitQueue(16, 4), 0
    for now in range(round(MISSED_FOR)):
        for number, source in enumerate("abcd" * 4, 100 * now + 1):
            with contextlib.suppress(RemoteProtocolError):
                queue = queue.enter(number, source, now)
        if now == 1:
            guest = 100 * now + 99
            queue = queue.enter(guest, "guest", now)
        queue, called = queue.call(1, now)
        if guest in called:
            return
        for one in called:
            queue = queue.leave(one, now)
    raise AssertionError("nobody else was ever called")


def test_a_missed_turn_costs_its_address_a_place_for_a_minute() -> None:
    queue, _ = WaitQueue(16, 1).enter(1, "a", 0.0).call(1, 0.0)
    queue = queue.leave(1, 5.0)
    words = "at most 0, since turns were missed there; a place more in 59 s"
    with pytest.raises(RemoteProtocolError, match=words):
        queue.enter(2, "a", 6.0)
    assert 2 in queue.enter(2, "a", 5.0 + MISSED_FOR)
    assert 3 in queue.enter(3, "b", 6.0)
