"""Another name for one who touches or waits, without a socket or a clock."""

from __future__ import annotations

from cohaptic.errors import CloseCode
from cohaptic.protocol.control.message import Named, SetName
from cohaptic.protocol.messages import Called, Place, UserJoined, Welcome, encode_control
from cohaptic.protocol.watch_messages import decode_watch_control
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.guard.limits import Budget, Limits
from cohaptic_server.guard.sources import Sources
from cohaptic_server.room.peer import Peer
from cohaptic_server.room.seats.wait_queue import TURN
from cohaptic_server.room.session_host import SessionHost
from cohaptic_server.room.session_setup import RoomAdmission
from tests.server.room.seats.test_waiting import COME, failed, full, leave, wait
from tests.server.room.test_session_host import join, news, say, session_host, watch


def rename(there: SessionHost, peer: Peer, name: str, now: float = 0.2) -> Named:
    """Ask for a name; the answer to it."""
    say(there, peer, encode_control(SetName(name=name)), now)
    return next(event for event in reversed(news(peer)) if isinstance(event, Named))


def names(there: SessionHost) -> list[str]:
    return [member.hello.name for member in there.room.members.values()]


def test_a_user_of_a_full_room_keeps_seat_and_number_and_everybody_hears_of_it(
    small_balloon: Balloon,
) -> None:
    there, (ann, bob) = full(small_balloon, users=2)
    waiting, page = wait(there, "waits"), watch(there)
    for peer in (ann, bob, waiting):
        news(peer)
    assert rename(there, ann, "ann of somewhere") == Named(name="ann of somewhere")
    assert names(there) == ["ann of somewhere", "user1"]
    heard = UserJoined(user=1, name="ann of somewhere")
    assert news(bob) == [heard]
    assert [decode_watch_control(str(data)) for data in page.session.take(clear=True)] == [heard]
    assert news(waiting) == []
    there.disconnect(ann, "bye")
    assert news(bob)[-1].name == "ann of somewhere"


def test_who_waits_keeps_its_place_and_comes_in_by_the_new_name(small_balloon: Balloon) -> None:
    there, (user,) = full(small_balloon)
    first, second = wait(there, "first"), wait(there, "second")
    news(second)
    assert rename(there, first, "ann") == Named(name="ann")
    there.serve(0.3)
    assert news(second) == []
    leave(there, user, 0.4)
    assert news(first)[-1] == Called(within=TURN)
    assert rename(there, first, "anna") == Named(name="anna")
    say(there, first, COME, 0.5)
    (welcome,) = news(first)
    assert isinstance(welcome, Welcome)
    assert (welcome.name, names(there)) == ("anna", ["anna"])
    assert news(second)[-1] == Place(place=1, of=1)


def test_a_name_of_another_stays_its_own_and_nobody_is_put_out_for_asking(
    small_balloon: Balloon,
) -> None:
    there, (ann, bob) = full(small_balloon, users=2)
    wait(there, "waits")
    there.room_admission.removed.add(bob.guest, "banned", "elsewhere", 0.0, 1e9, ban=True)
    for name, why in (
        ("user1", "is taken"),
        ("waits", "waits for a seat"),
        ("banned", "banned"),
    ):
        answer = rename(there, ann, name)
        assert answer.name == "user0"
        assert why in answer.reason
    assert names(there) == ["user0", "user1"]
    assert rename(there, ann, "user0") == Named(name="user0")
    assert ann.session.close is None


def test_who_is_muted_stays_so_by_every_name(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    bad = join(there, "bad")
    there.room.members[1].muted = True
    assert rename(there, bad, "good") == Named(name="good")
    there.disconnect(bad, "bye")
    join(there, "good", 1.0)
    assert there.room.members[2].muted


def test_a_flood_of_names_is_counted_as_one_of_joins(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    there.room_admission = RoomAdmission(Sources(Limits(joins=Budget(1.0, 3.0))))
    bad, other = join(there, "bad"), join(there, "other")
    for k in range(10):
        say(there, bad, encode_control(SetName(name=f"bad{k}")), 0.1)
    assert failed(bad)[0] == CloseCode.TOO_MANY.value
    assert other.session.close is None
    # Of the names of one who is there already the newest is news.
    heard = [event for event in news(other) if isinstance(event, UserJoined)]
    assert [event.name for event in heard] == ["bad2"]
