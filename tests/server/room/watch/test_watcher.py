"""A watcher against every order of ticks, acks, rates and pauses that hypothesis finds."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from cohaptic.errors import CloseCode
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import (
    EncodingName,
    Latency,
    SetView,
    Watch,
    decode_watch_control,
)
from cohaptic_server.room.outbox import MAX_EVENTS
from cohaptic_server.room.watch.watcher import DROPPED_AFTER, IN_FLIGHT, SLOW_AFTER
from tests.examples_of_laws import examples
from tests.server.peers import hello_text, sample
from tests.server.room.watch.watchers import ANSWER, NEWS, Sent, ended, watcher

TICK = 1 / 60  # s


class Watched(RuleBasedStateMachine):
    """A watcher, the world that it is shown, and what its page has done."""

    def __init__(self) -> None:
        super().__init__()
        self.now, self.tick, self.version = 0.0, 0, 0
        self.sent: list[Sent] = []
        self.acknowledged = 0  # scenes
        self.wants = False
        self.full_since: float | None = None

    @initialize(
        encoding=st.sampled_from(["frames", "forces"]),
        rate=st.sampled_from([1.0, 7.0, 30.0, 60.0]),
        has_model=st.booleans(),
    )
    def begin(self, encoding: EncodingName, rate: float, has_model: bool) -> None:
        self.encoding, self.rate, self.has_model = encoding, rate, has_model
        self.watcher = watcher(encoding, rate, has_model=has_model)
        self.viewed = 0  # scenes sent when the view was last set

    @property
    def surface(self) -> bool:
        return self.wants or self.encoding == "frames" or not self.has_model

    @property
    def flying(self) -> int:
        return len(self.sent) - self.acknowledged

    @property
    def open(self) -> bool:
        return self.watcher.close is None

    @rule(changed=st.booleans(), clear=st.booleans(), pause=st.sampled_from([TICK, 0.3, 3.0]))
    def passes(self, changed: bool, clear: bool, pause: float) -> None:
        """A tick, as the gallery goes through it."""
        self.now += pause
        self.tick += 1
        self.version += changed or self.tick == 1
        self.follow(clear)
        if self.watcher.due(self.version, self.now, clear=clear):
            assert clear, "nothing is piled on a path that is full"
            assert self.flying < IN_FLIGHT
            last = self.sent[-1] if self.sent else None
            news = last is None or self.version > last.version
            assert news or (self.surface and last is not None and not last.surface), (
                "idle costs nothing"
            )
            assert self.watcher.wants_surface == self.surface
            frame = f"{self.tick}".encode()
            self.watcher.put_scene(frame, self.tick, self.version, self.now)
            # Newest wins: what goes out is this tick's, and alone.
            assert self.watcher.take(clear=True) == [frame]
            self.sent.append(Sent(self.tick, self.version, self.surface, self.now))
        elif self.open and clear and self.flying < IN_FLIGHT:
            last = self.sent[-1] if self.sent else None
            if last is None:
                raise AssertionError("who comes late is shown what is there at once")
            nothing_new = self.version == last.version and (last.surface or not self.surface)
            assert nothing_new or self.now - last.at < 1.0 / self.rate + 1e-9
        self.watcher.handle_timer(self.now)
        behind = 0.0 if self.full_since is None else self.now - self.full_since
        if behind >= DROPPED_AFTER:
            assert self.watcher.close is not None
            assert self.watcher.close[0] == CloseCode.TOO_SLOW.value
        elif self.open:
            assert self.watcher.slow == (behind >= SLOW_AFTER)

    def follow(self, clear: bool) -> None:
        """When it fell behind, as a page would count it."""
        behind = self.flying >= IN_FLIGHT or (self.flying > 0 and not clear)
        if not behind:
            self.full_since = None
        elif self.full_since is None:
            self.full_since = self.now

    @precondition(lambda self: self.flying > 0 and self.open)
    @rule(data=st.data(), wants=st.booleans())
    def acknowledges(self, data: st.DataObject, wants: bool) -> None:
        upto = data.draw(st.integers(self.acknowledged, len(self.sent) - 1))
        self.watcher.receive(Ack(self.sent[upto].tick, int(wants)).encode(), self.now)
        self.acknowledged = upto + 1
        self.wants = wants
        assert self.open

    @precondition(lambda self: self.sent and self.open)
    @rule(wants=st.booleans())
    def acknowledges_again(self, wants: bool) -> None:
        self.watcher.receive(Ack(self.sent[0].tick, int(wants)).encode(), self.now)
        self.acknowledged = max(self.acknowledged, 1)
        self.wants = wants
        assert self.open

    @precondition(lambda self: self.open)
    @rule(encoding=st.sampled_from(["frames", "forces"]))
    def looks_otherwise(self, encoding: EncodingName) -> None:
        self.watcher.receive(encode_control(SetView(encoding=encoding, rate=self.rate)), self.now)
        self.encoding = encoding

    @precondition(lambda self: self.open)
    @rule()
    def acknowledges_what_never_came(self) -> None:
        """Ends the session, so it is done on one that is given up."""
        last = self.sent[-1].tick if self.sent else 0
        other = watcher()
        other.receive(Ack(last + 1).encode(), self.now)
        assert ended(other)[0] == CloseCode.BAD_MESSAGE.value

    @invariant()
    def at_most_two_are_unacknowledged(self) -> None:
        assert self.flying <= IN_FLIGHT

    @invariant()
    def ticks_rise(self) -> None:
        ticks = [sent.tick for sent in self.sent]
        assert ticks == sorted(set(ticks))


Watched.TestCase.settings = settings(
    max_examples=examples(60),
    stateful_step_count=30,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
TestWatched = Watched.TestCase


@given(st.floats(1.0, 60.0), st.sampled_from([10.0, 60.0, 200.0]))
@example(30.0, 60.0)
@example(60.0, 60.0)
def test_the_rate_is_kept_and_reached(rate: float, simulation_hz: float) -> None:
    made = watcher(rate=rate)
    seconds, count = 10, 0
    for tick in range(1, round(seconds * simulation_hz) + 1):
        now = tick / simulation_hz
        if made.due(tick, now, clear=True):
            made.put_scene(b"scene", tick, tick, now)
            made.receive(Ack(tick).encode(), now)
            count += 1
    assert count <= rate * seconds + 2
    # Each waits for a tick.
    assert count >= seconds / (1.0 / rate + 1.0 / simulation_hz) - 2
    if simulation_hz == 60.0 and rate in (30.0, 60.0):
        assert count >= rate * seconds - 1


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (
            hello_text(),
            "message is 'Hello'; expected Ack, SetView, SetLatency, Moderate or Mark: watches",
        ),
        (sample().encode(), "frame kind is 1; expected 5 (ack)"),
        ("{", "Invalid JSON"),
        (b"", "frame length is 0"),
        (encode_control(Watch(protocol=PROTOCOL_VERSION)), "message is 'Watch'"),
    ],
)
def test_who_watches_cannot_touch_and_is_told(said: str | bytes, words: str) -> None:
    made = watcher()
    made.receive(said, 0.0)
    code, error = ended(made)
    assert code == CloseCode.BAD_MESSAGE.value
    assert words in error.message


@given(st.lists(st.text(max_size=200) | st.binary(max_size=200), max_size=4))
def test_whatever_is_said_nothing_is_raised(said: list[str | bytes]) -> None:
    made = watcher()
    for data in said:
        made.receive(data, 0.0)
    if made.close is not None:
        assert made.close[1].isprintable()
        # What comes after the end is not answered: the end was.
        made.take(clear=True)
        made.receive(b"", 0.0)
        assert made.take(clear=True) == []


def test_of_each_users_latency_only_the_newest_waits_and_the_scene_comes_last() -> None:
    made = watcher()
    made.send(NEWS)
    for delay in (0.1, 0.2, 0.3):
        made.tell_latency(Latency(user=1, delay=delay, jitter=0.0))
    made.tell_latency(Latency(user=2, delay=0.0, jitter=0.0))
    made.put_scene(b"scene", 1, 1, 0.0)
    assert made.take(clear=False) == []
    *texts, scene = made.take(clear=True)
    assert [decode_watch_control(str(data)) for data in texts] == [
        NEWS,
        Latency(user=1, delay=0.3, jitter=0.0),
        Latency(user=2, delay=0.0, jitter=0.0),
    ]
    assert scene == b"scene"
    assert made.take(clear=True) == []


@given(st.lists(st.integers(1, 2**32 - 1), max_size=200))
def test_latencies_that_wait_are_bounded(users: list[int]) -> None:
    made = watcher()
    for user in users:
        made.tell_latency(Latency(user=user, delay=0.5, jitter=0.0))
    assert len(made.take(clear=True)) <= 64
    assert made.close is None


def test_one_that_lets_events_pile_up_is_closed() -> None:
    made = watcher()
    for _ in range(MAX_EVENTS):
        made.send(ANSWER)
    assert made.close is None
    made.send(ANSWER)
    assert made.close == (
        CloseCode.TOO_SLOW.value,
        "64 events wait for this client, the limit: it is too slow",
    )


def test_a_server_that_stops_says_so_and_forgets_no_earlier_end() -> None:
    made = watcher()
    made.stop(CloseCode.SERVER_STOPS, "the server stops")
    assert made.close == (CloseCode.SERVER_STOPS.value, "the server stops")
    other = watcher()
    other.receive("{", 0.0)
    first = other.close
    other.stop(CloseCode.SERVER_STOPS, "the server stops")
    assert other.close == first
