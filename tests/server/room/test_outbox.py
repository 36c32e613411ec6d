from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic.protocol.messages import (
    Place,
    Restraints,
    RoomUser,
    UserJoined,
    UserLeft,
    Welcome,
    decode_server_control,
    encode_control,
)
from cohaptic.protocol.watch_messages import PutOut, Watching
from cohaptic_server.room.outbox import MAX_EVENTS, Outbox
from tests.server.room.sessions import BODY

# What happens at an outbox, in any order: an event, a patch, or a chance to write.
happenings = st.lists(st.sampled_from(["event", "patch", "clear", "blocked"]), max_size=300)


@given(happenings)
def test_events_keep_order_and_patches_are_the_newest(order: list[str]) -> None:
    outbox = Outbox()
    queued: list[str] = []
    written: list[str | bytes] = []
    newest, patches = 0, 0
    for number, what in enumerate(order, start=1):
        if what == "event" and outbox.put_event(str(number)):
            queued.append(str(number))
        elif what == "patch":
            outbox.put_patch(number.to_bytes(2, "big"))
            newest, patches = number, patches + 1
        elif what == "clear":
            taken = outbox.take(clear=True)
            assert [t for t in taken[:-1] if isinstance(t, bytes)] == []
            if taken and isinstance(taken[-1], bytes):
                assert int.from_bytes(taken[-1], "big") == newest
            written += taken
        elif what == "blocked":
            assert outbox.take(clear=False) == []
    written += outbox.take(clear=True)
    assert [w for w in written if isinstance(w, str)] == queued
    frames = [int.from_bytes(w, "big") for w in written if isinstance(w, bytes)]
    assert frames == sorted(set(frames))
    assert len(frames) + outbox.patches_skipped == patches


@given(st.integers(0, 3 * MAX_EVENTS), st.integers(0, 1000))
def test_a_client_that_reads_nothing_costs_a_bounded_amount(events: int, patches: int) -> None:
    outbox = Outbox()
    kept = [outbox.put_event(str(i)) for i in range(events)]
    for _ in range(patches):
        outbox.put_patch(b"patch")
    assert kept == [i < MAX_EVENTS for i in range(events)]
    assert len(outbox.take(clear=True)) == min(events, MAX_EVENTS) + min(patches, 1)


class Guests:
    """A room of a few users, and a client that is told of them."""

    def __init__(self, before: int) -> None:
        self.here = {user: f"user{user}" for user in range(1, before + 2)}
        self.next, self.reported = before + 2, dict(self.here)  # the client itself came last
        self.outbox = Outbox()
        others = [(user, name) for user, name in self.here.items() if user != before + 1]
        names = tuple(RoomUser(user=user, name=name) for user, name in others)
        welcome = Welcome(
            user=before + 1, name="me", simulation_period=0.02, body=BODY, users=names
        )
        assert self.outbox.put(welcome)
        self.outbox.take(clear=True)

    def happen(self, what: str, which: int) -> None:
        if what == "joins":
            user, self.next = self.next, self.next + 1
            self.here[user] = f"user{user}"
            assert self.outbox.put(UserJoined(user=user, name=self.here[user]))
        elif what == "writes":
            self.hear(self.outbox.take(clear=True))
        elif self.here:
            user = sorted(self.here)[which % len(self.here)]
            if what == "renames":
                self.here[user] += "x"
                assert self.outbox.put(UserJoined(user=user, name=self.here[user]))
            else:
                left = UserLeft(user=user, name=self.here.pop(user), reason="bye")
                assert self.outbox.put(left)

    def hear(self, written: list[str | bytes]) -> None:
        known = set(self.reported)
        for data in written:
            news = decode_server_control(str(data))
            assert isinstance(news, UserJoined | UserLeft)
            if isinstance(news, UserJoined):
                self.reported[news.user] = news.name
            else:
                # Nobody leaves of whom the client had not heard.
                assert news.user in known
                assert self.reported.pop(news.user) == news.name
        assert self.reported == self.here
        assert len(written) <= 2 * len(known) + len(self.here)


@given(
    st.integers(0, 5),
    st.lists(
        st.tuples(
            st.sampled_from(["joins", "joins", "renames", "leaves", "writes"]), st.integers(0, 9)
        ),
        max_size=200,
    ),
)
def test_whoever_comes_and_goes_a_client_knows_in_the_end_who_is_here(
    before: int, order: list[tuple[str, int]]
) -> None:
    guests = Guests(before)
    for what, which in order:
        guests.happen(what, which)
    guests.happen("writes", 0)
    assert guests.outbox.empty


def test_of_what_is_state_the_newest_is_told() -> None:
    outbox = Outbox()
    for k in range(10 * MAX_EVENTS):
        assert outbox.put(Place(place=1, of=1 + k))
        assert outbox.put(Restraints(frozen=bool(k % 2), muted=(k,)))
        assert outbox.put(PutOut(names=(str(k),)))
    last = 10 * MAX_EVENTS - 1
    assert outbox.take(clear=True) == [
        encode_control(Place(place=1, of=1 + last)),
        encode_control(Restraints(frozen=True, muted=(last,))),
        encode_control(PutOut(names=(str(last),))),
    ]


def test_one_who_watches_hears_of_nobody_who_came_and_left_meanwhile() -> None:
    outbox = Outbox()
    there = (RoomUser(user=3, name="ann"), RoomUser(user=7, name="bob"))
    assert outbox.put(
        Watching(
            simulation_period=0.02,
            to_wall=0.0,
            body=BODY,
            model=None,
            users=there,
            allow_latency=False,
            allow_fixed_gains=False,
        )
    )
    outbox.take(clear=True)
    news = (
        UserJoined(user=7, name="carl"),
        UserJoined(user=8, name="eve"),
        UserLeft(user=3, name="ann", reason="bye"),
        UserLeft(user=8, name="eve", reason="bye"),
        UserLeft(user=7, name="carl", reason="bye"),
    )
    assert all(outbox.put(message) for message in news)
    assert outbox.take(clear=True) == [encode_control(news[k]) for k in (0, 2, 4)]
