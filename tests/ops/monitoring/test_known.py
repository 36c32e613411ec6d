"""When a server counts as alive, and as ready."""

from __future__ import annotations

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from cohaptic_ops.monitoring.known import STALE, Known
from cohaptic_ops.monitoring.metrics import RoomHealth
from tests.ops.monitoring.some import health, room, ticking

OPEN = RoomHealth(name="main", state="open")


def test_a_room_is_ready_once_its_ticks_are_seen_to_move() -> None:
    known = Known()
    known.take(health(), 0.0)
    known.take(room(ticks=5), 0.0)
    assert known.why_not_ready(0.0) == ["room main: does not tick"]
    known.take(room(ticks=5), 1.0)
    assert known.why_not_ready(1.0)
    known.take(room(ticks=6), 2.0)
    assert known.why_not_ready(2.0) == []


def test_a_server_that_drains_is_alive_and_not_ready_though_it_ticks() -> None:
    known = ticking()
    known.take(health(draining=True), 1.0)
    assert known.why_not_alive(1.0) == []
    assert known.why_not_ready(1.0) == ["the server is draining"]
    assert known.why_not_ready(1.0, "main") == ["the server is draining"]


def test_one_broken_room_keeps_nobody_from_the_others_and_is_told() -> None:
    known = ticking(room("main"), room("other"))
    broken = RoomHealth(name="other", state="broken", problem="no triangle", restarts=2)
    known.take(health(OPEN, broken), 1.0)
    assert known.why_not_ready(1.0) == []
    assert known.why_not_ticking(1.0) == {"other": "broken: no triangle"}
    assert known.why_not_ready(1.0, "other") == ["broken: no triangle"]
    assert known.why_not_ready(1.0, "main") == []
    assert known.why_not_ready(1.0, "nowhere") == ["no such room"]


def test_fewer_ticks_are_a_new_process_which_has_to_show_that_it_ticks() -> None:
    known = ticking()
    known.take(room(ticks=3), 3.5)
    known.take(health(), 4.5)
    assert known.why_not_ready(4.5) == ["room main: does not tick"]
    known.take(room(ticks=4), 4.5)
    assert known.why_not_ready(4.5) == []


class ServersLaws(RuleBasedStateMachine):
    """Whatever comes, in any order and at any time."""

    def __init__(self) -> None:
        super().__init__()
        self.known, self.now = Known(), 0.0
        self.moved: dict[str, float] = {}
        self.ticks: dict[str, int] = {}
        self.draining = False

    @rule(step=st.floats(0.0, 5.0))
    def wait(self, step: float) -> None:
        self.now += step

    @rule(draining=st.booleans(), states=st.lists(st.sampled_from(["open", "broken"]), max_size=2))
    def say(self, draining: bool, states: list[str]) -> None:
        self.draining = draining
        names = ("main", "other")
        rooms = [
            RoomHealth(name=n, state=s, restarts=1) for n, s in zip(names, states, strict=False)
        ]
        self.known.take(health(*rooms, draining=draining), self.now)

    @rule(name=st.sampled_from(["main", "other"]), ticks=st.integers(0, 100))
    def report(self, name: str, ticks: int) -> None:
        if ticks > self.ticks.get(name, 1000):
            self.moved[name] = self.now
        self.ticks[name] = ticks
        self.known.take(room(name, ticks), self.now)

    @invariant()
    def nobody_is_sent_to_a_server_whose_rooms_do_not_tick(self) -> None:
        if not self.known.why_not_ready(self.now):
            assert not self.draining
            assert any(self.now - at <= STALE for at in self.moved.values())


TestServers = ServersLaws.TestCase
