"""People who wait before a full room, without a socket or a clock."""

from __future__ import annotations

from typing import Any

import pytest

from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import (
    Bye,
    Called,
    Come,
    Error,
    Place,
    Welcome,
    encode_control,
)
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.guard.limits import Limits
from cohaptic_server.room.outbox import MAX_EVENTS
from cohaptic_server.room.peer import Peer
from cohaptic_server.room.seats.names import SEAT_KEPT_FOR
from cohaptic_server.room.seats.wait_queue import TURN
from cohaptic_server.room.seats.waiting import REPEAT
from cohaptic_server.room.session_host import SessionHost
from cohaptic_server.settings import ServerSettings
from tests.server.peers import hello, sample
from tests.server.room.test_session_host import connect, join, news, say, session_host

COME = encode_control(Come())


def full(body: Balloon, users: int = 1, **settings: Any) -> tuple[SessionHost, list[Peer]]:
    """A room whose seats are all taken."""
    there = session_host(body, max_users=users, **settings)
    return there, [join(there, f"user{i}") for i in range(users)]


def wait(
    there: SessionHost, name: str, now: float = 0.0, source: str = "", key: str | None = None
) -> Peer:
    peer = connect(there, now)
    peer.source = source
    changes = {"wait": True, "key": key}
    say(there, peer, encode_control(hello(name).model_copy(update=changes)), now)
    there.serve(now)
    return peer


def leave(there: SessionHost, peer: Peer, now: float) -> None:
    say(there, peer, encode_control(Bye()), now)
    there.disconnect(peer, "")
    there.serve(now)


def failed(peer: Peer) -> tuple[int, str]:
    assert peer.session.close is not None
    return peer.session.close


def test_who_waits_is_told_its_place_is_called_in_turn_and_comes_in(
    small_balloon: Balloon,
) -> None:
    there, (user,) = full(small_balloon)
    first, second = wait(there, "first"), wait(there, "second")
    assert news(first) == [Place(place=1, of=2)]
    assert news(second) == [Place(place=2, of=2)]
    there.serve(0.1)
    assert news(first) == news(second) == []
    leave(there, user, 0.2)
    assert news(first) == [Called(within=TURN)]
    assert news(second) == [Place(place=1, of=1)]
    # The seat is kept for who was called: nobody else gets it meanwhile.
    other = join(there, "other", 0.3)
    code, reason = failed(other)
    assert (code, "2 wait for a place already" in reason) == (CloseCode.ROOM_FULL.value, True)
    say(there, first, COME, 0.4)
    (welcome,) = news(first)
    assert isinstance(welcome, Welcome)
    assert [m.hello.name for m in there.room.members.values()] == ["first"]
    there.serve(0.5)
    assert news(second) == []
    assert len(there.room.queue) == 1


def test_a_place_is_told_again_as_a_sign_of_life_but_not_to_who_takes_nothing(
    small_balloon: Balloon,
) -> None:
    there, _ = full(small_balloon)
    hears, deaf = wait(there, "hears"), wait(there, "deaf")
    news(hears)
    news(deaf)
    there.serve(0.99 * REPEAT)
    assert news(hears) == []
    for k in range(1, 100):
        there.serve(k * REPEAT)
        assert news(hears) == [Place(place=1, of=2)]
    assert news(deaf) == [Place(place=2, of=2)]
    assert deaf.session.close is None


def test_others_in_the_queue_cannot_get_one_closed_whose_path_is_slow(
    small_balloon: Balloon,
) -> None:
    there, _ = full(small_balloon)
    slow = wait(there, "slow", source="slow")
    for k in range(MAX_EVENTS):
        leave(there, wait(there, "other", source="other"), 0.01 * k)
    assert slow.session.close is None
    assert news(slow) == [Place(place=1, of=1)]


def test_the_seat_of_a_lost_connection_is_not_free_until_it_is_kept_no_longer(
    small_balloon: Balloon,
) -> None:
    there, (user,) = full(small_balloon)
    there.tick(100.0)
    waiting = wait(there, "waits", 100.0)
    there.disconnect(user, "")
    there.serve(100.0)
    assert news(waiting) == [Place(place=1, of=1)]
    back = join(there, "user0", 101.0)  # its owner comes back past the queue
    assert back.session.close is None
    there.tick(200.0)
    there.disconnect(back, "")
    there.serve(200.0 + 0.99 * SEAT_KEPT_FOR)
    assert news(waiting) == [Place(place=1, of=1)]  # as before
    there.serve(200.0 + 1.01 * SEAT_KEPT_FOR)
    assert news(waiting) == [Called(within=TURN)]
    # It comes back too late: its name is kept, and its seat is somebody else's.
    late = join(there, "user0", 201.0 + SEAT_KEPT_FOR)
    assert failed(late)[0] == CloseCode.ROOM_FULL.value


def test_who_is_called_and_does_not_come_loses_the_turn(small_balloon: Balloon) -> None:
    there, (user,) = full(small_balloon)
    first, second = wait(there, "first"), wait(there, "second")
    leave(there, user, 1.0)
    there.serve(1.0 + 0.99 * TURN)
    assert first.session.close is None
    there.serve(1.0 + TURN)
    code, reason = failed(first)
    assert (code, "the place went to the next" in reason) == (CloseCode.ROOM_FULL.value, True)
    assert news(second)[-1] == Called(within=TURN)
    say(there, first, COME, 1.1 + TURN)  # it is too late
    there.disconnect(first, "")
    say(there, second, COME, 1.2 + TURN)
    assert [m.hello.name for m in there.room.members.values()] == ["second"]


@pytest.mark.parametrize("said", ["come", "sample", "hello"])
def test_who_comes_uncalled_ends_its_own_session_alone(small_balloon: Balloon, said: str) -> None:
    there, _ = full(small_balloon)
    first, second = wait(there, "first"), wait(there, "second")
    words: dict[str, str | bytes] = {
        "come": COME,
        "sample": sample().encode(),
        "hello": encode_control(hello("again")),
    }
    say(there, first, words[said])
    assert failed(first)[0] == CloseCode.BAD_MESSAGE.value
    there.serve(0.1)
    assert news(second)[-1] == Place(place=1, of=1)
    assert len(there.room.members) == 1


def test_leaving_gives_the_place_up_and_those_behind_are_told(small_balloon: Balloon) -> None:
    there, _ = full(small_balloon)
    first, second, third = (wait(there, name) for name in ("first", "second", "third"))
    leave(there, second, 0.1)
    there.disconnect(first, "")
    there.serve(0.2)
    assert news(third)[-1] == Place(place=1, of=1)
    assert len(there.room.queue) == len(there.session_setup.waiting) == 1


def test_one_address_cannot_fill_the_queue_and_a_full_one_says_so(small_balloon: Balloon) -> None:
    there, _ = full(small_balloon, max_waiting=3, limits=Limits(waiting=2))
    hostile = [wait(there, f"bad{i}", source="bad") for i in range(50)]
    assert sum(peer.session.close is None for peer in hostile) == 2
    assert "from one address is 3; expected at most 2" in failed(hostile[-1])[1]
    guest = wait(there, "guest", source="good")
    assert news(guest) == [Place(place=3, of=3)]
    last = wait(there, "last", source="other")
    assert "number of people who wait is 4; expected at most 3" in failed(last)[1]


def test_another_connection_of_the_same_person_has_its_place(small_balloon: Balloon) -> None:
    there, (user,) = full(small_balloon)
    first = wait(there, "ann", key="a" * 16)
    other = wait(there, "bob")
    thief = wait(there, "ann", key="b" * 16)
    assert failed(thief)[0] == CloseCode.NAME_TAKEN.value
    again = wait(there, "ann", key="a" * 16)
    assert first.session.close is not None
    there.disconnect(first, "")
    there.serve(0.1)
    assert news(again)[-1] == Place(place=1, of=2)
    assert news(other)[-1] == Place(place=2, of=2)
    leave(there, user, 0.2)
    assert news(again) == [Called(within=TURN)]
    third = wait(there, "ann", 0.3, key="a" * 16)  # its connection broke just when it was called
    assert news(third) == [Called(within=TURN - 0.1)]  # what is left of the turn
    say(there, third, COME, 0.4)
    assert [m.hello.name for m in there.room.members.values()] == ["ann"]


def test_the_name_of_one_who_waits_is_nobody_elses(small_balloon: Balloon) -> None:
    there, users = full(small_balloon, users=2)
    ann = wait(there, "ann", key="a" * 16)
    for user in users:
        leave(there, user, 0.1)
    assert news(ann)[-1] == Called(within=TURN)
    # There is a seat for one more, but not by that name.
    thief = join(there, "ann", 0.2)
    code, reason = failed(thief)
    assert (code, "somebody who waits for a seat has it" in reason) == (
        CloseCode.NAME_TAKEN.value,
        True,
    )
    say(there, ann, COME, 0.3)
    assert [m.hello.name for m in there.room.members.values()] == ["ann"]


def test_who_finds_a_seat_by_another_connection_waits_no_more(small_balloon: Balloon) -> None:
    there, users = full(small_balloon, users=2)
    first = wait(there, "ann", key="a" * 16)
    for user in users:
        leave(there, user, 0.1)
    second = wait(there, "ann", 0.2, key="a" * 16)
    assert "it has come back with another" in failed(first)[1]
    assert isinstance(news(second)[0], Welcome)
    assert len(there.room.queue) == len(there.session_setup.waiting) == 0


def test_four_addresses_that_miss_their_turns_do_not_hold_the_queue(small_balloon: Balloon) -> None:
    there, (user,) = full(small_balloon, max_waiting=4, limits=Limits(waiting=1))
    hostile = [wait(there, f"bad{i}", source=f"bad{i}") for i in range(4)]
    leave(there, user, 0.1)
    for k in range(1, 5):
        there.serve(k * (TURN + 0.1))
    assert [failed(peer)[0] for peer in hostile] == 4 * [CloseCode.ROOM_FULL.value]
    last = join(there, "last", 4.0 * TURN + 1.0)
    assert last.session.close is None
    for i in range(4):
        again = wait(there, f"bad{i}", 4.0 * TURN + 2.0, source=f"bad{i}")
        assert "since turns were missed there" in failed(again)[1]
    guest = wait(there, "guest", 4.0 * TURN + 3.0, source="good")
    assert news(guest) == [Place(place=1, of=1)]


def test_the_log_says_who_waits_is_called_and_waits_no_more(small_balloon: Balloon) -> None:
    there, (user,) = full(small_balloon)
    wait(there, "first")
    say(there, user, encode_control(Bye()), 0.1)
    there.disconnect(user, "")
    (line,) = there.serve(0.1).log
    assert (line.event, line.text) == ("called", "first is called to a place")
    late = there.serve(0.1 + TURN)
    assert [line.text for line in late.log] == ["first was called to a place and did not come"]


def test_without_a_queue_nobody_is_offered_to_wait(small_balloon: Balloon) -> None:
    there, _ = full(small_balloon, max_waiting=0)
    assert "wait for a place" not in failed(join(there, "direct"))[1]
    assert failed(wait(there, "waits"))[0] == CloseCode.ROOM_FULL.value


def test_who_was_banned_while_it_waited_does_not_come_in(small_balloon: Balloon) -> None:
    there, (user,) = full(small_balloon)
    waiting = wait(there, "bad", source="bad")
    there.room_admission.removed.add(waiting.guest, "bad", "bad", 0.1, 1e9, ban=True)
    leave(there, user, 0.2)
    say(there, waiting, COME, 0.3)
    last = news(waiting)[-1]
    assert isinstance(last, Error)
    assert (last.code, len(there.room.members)) == (CloseCode.FORBIDDEN.value, 0)


def test_a_room_that_lost_seats_to_other_rooms_calls_nobody(small_balloon: Balloon) -> None:
    there, users = full(small_balloon, users=3)
    there.room.seats.allow(3, 3)
    waiting = wait(there, "waits")
    there.room.seats.allow(1, there.room.seated(0.0))
    say(there, users[0], encode_control(Bye()), 0.1)
    there.disconnect(users[0], "")
    there.room.seats.give_back(there.room.seated(0.1))
    there.serve(0.2)
    assert news(waiting) == [Place(place=1, of=1)]
    there.room.seats.allow(3, there.room.seated(0.2))
    there.serve(0.3)
    assert news(waiting) == [Called(within=TURN)]
    # What was promised is not given back.
    there.room.seats.allow(0, there.room.seated(0.3))
    assert there.room.seats.give_back(there.room.seated(0.4)) == 3
    say(there, waiting, COME, 0.5)
    assert len(there.room.members) == 3


def test_a_queue_is_from_0_to_64() -> None:
    ServerSettings(max_waiting=0)
    with pytest.raises(Exception, match="max_waiting is 65"):
        ServerSettings(max_waiting=65)
