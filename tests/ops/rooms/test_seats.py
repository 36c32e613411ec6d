from __future__ import annotations

from collections import deque

from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from cohaptic_ops.rooms.seats import SeatPool
from cohaptic_server.room.room import Seating
from tests.examples_of_laws import examples

TOTAL = 7
LARGEST = {"a": 4, "b": 5, "c": 3}


class Seated(RuleBasedStateMachine):
    """Rooms whose messages are late, in order, and lost when a process ends."""

    def __init__(self) -> None:
        super().__init__()
        self.pool = SeatPool(TOTAL, LARGEST)
        self.there = set(LARGEST)
        self.rooms = {name: self.fresh(name) for name in LARGEST}
        self.used = dict.fromkeys(LARGEST, 0)
        self.serial = dict.fromkeys(LARGEST, 0)
        self.down: dict[str, deque[tuple[int, int]]] = {name: deque() for name in LARGEST}
        self.up: dict[str, deque[tuple[int, int, int]]] = {name: deque() for name in LARGEST}

    def fresh(self, name: str) -> Seating:
        seats = Seating(LARGEST[name], "users")
        seats.allow(0, 0)
        return seats

    @rule()
    def share(self) -> None:
        for name, wanted in self.pool.share(self.there).items():
            self.down[name].append((wanted, self.pool[name].serial))

    @rule(name=st.sampled_from(sorted(LARGEST)))
    def read(self, name: str) -> None:
        if self.down[name]:
            wanted, self.serial[name] = self.down[name].popleft()
            self.rooms[name].allow(wanted, self.used[name])

    @rule(name=st.sampled_from(sorted(LARGEST)))
    def come(self, name: str) -> None:
        held = self.rooms[name].held or 0
        if self.used[name] < min(held, LARGEST[name]):
            self.rooms[name].check(self.used[name])
            self.used[name] += 1

    @rule(name=st.sampled_from(sorted(LARGEST)))
    def leave(self, name: str) -> None:
        self.used[name] = max(0, self.used[name] - 1)

    @rule(name=st.sampled_from(sorted(LARGEST)))
    def tell(self, name: str) -> None:
        held = self.rooms[name].give_back(self.used[name])
        self.up[name].append((held, self.used[name], self.serial[name]))

    @rule(name=st.sampled_from(sorted(LARGEST)))
    def hear(self, name: str) -> None:
        if self.up[name]:
            self.pool.report(name, *self.up[name].popleft())

    @rule(name=st.sampled_from(sorted(LARGEST)))
    def end(self, name: str) -> None:
        self.rooms[name], self.used[name] = self.fresh(name), 0
        self.serial[name] = 0
        self.down[name].clear()
        self.up[name].clear()
        self.pool.lose(name)
        self.there.discard(name)

    @rule(name=st.sampled_from(sorted(LARGEST)))
    def begin(self, name: str) -> None:
        self.there.add(name)

    @invariant()
    def no_more_sit_than_there_are_seats(self) -> None:
        assert sum(self.used.values()) <= TOTAL
        assert sum(seats.held or 0 for seats in self.rooms.values()) <= TOTAL
        assert self.pool.free >= 0


TestSeated = Seated.TestCase
TestSeated.settings = hypothesis_settings(
    max_examples=examples(200), stateful_step_count=40, deadline=None
)


@given(st.integers(0, 30), st.dictionaries(st.text(max_size=3), st.integers(0, 9), max_size=6))
def test_all_seats_are_shared_as_far_as_rooms_can_use_them(
    total: int, limit: dict[str, int]
) -> None:
    pool = SeatPool(total, limit)
    shares = pool.share(limit)
    given_ = [shares.get(name, 0) for name in limit]
    assert sum(given_) == min(total, sum(limit.values()))
    assert all(number <= limit[name] for name, number in shares.items())
    # Nobody has two less than another one unless it can use no more.
    for name, number in zip(limit, given_, strict=True):
        assert number == limit[name] or number >= max(given_, default=0) - 1
    assert pool.share(limit) == {}


def test_a_room_that_was_told_to_hold_fewer_is_believed_once_it_has_read_that() -> None:
    pool = SeatPool(4, {"a": 4, "b": 4})
    assert pool.share("ab") == {"a": 2, "b": 2}
    pool.report("a", 2, 2, 1)
    pool.report("b", 2, 0, 1)
    assert pool.share("ab") == {"b": 1}
    pool.report("b", 2, 0, 1)  # written before it read that
    assert pool.share("ab") == {}
    pool.report("b", 1, 0, 2)
    assert pool.share("ab") == {"a": 3}


def test_the_last_seat_is_for_an_empty_room_and_not_for_a_second_visitor() -> None:
    """With the first room before all others the empty one lost its only seat to it."""
    pool = SeatPool(2, {"a": 2, "b": 2})
    assert pool.share({"a", "b"}) == {"a": 1, "b": 1}
    for room, other in (("a", "b"), ("b", "a")):
        pool.report(room, held=1, used=1, serial=pool[room].serial)
        pool.report(other, held=1, used=0, serial=pool[other].serial)
        assert pool.share({"a", "b"}) == {}
