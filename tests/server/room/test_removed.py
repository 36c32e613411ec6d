from __future__ import annotations

import pytest

from cohaptic.errors import CloseCode
from cohaptic.protocol.watch_messages import Moderated, PutOut
from cohaptic.protocol.watch_messages import decode_watch_control as _decode
from cohaptic_server.access.admission import ANYBODY, Guest
from cohaptic_server.access.keys import Denied
from cohaptic_server.access.remembered import (
    MAX_REMOVED,
    Record,
    Removal,
    decode,
    encode,
    still_counting,
)
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.room.moderation import KICKED_FOR, Removed
from cohaptic_server.room.room import Room
from cohaptic_server.room.session_host import SessionHost
from cohaptic_server.room.session_setup import RoomAdmission
from cohaptic_server.room.watch.scene_broadcast import SceneBroadcast
from cohaptic_server.settings import ServerSettings
from tests.server.access.some import NOW, admission, token
from tests.server.room.test_moderation import ADMIN, ordered
from tests.server.room.test_session_setup import hello, refused, say, session_host, watch, welcome


def guest(session: str, invitation: str = "i", since: float = 0.0) -> Guest:
    return Guest(sub="a", session=session, invitation=invitation, since=since)


def test_the_list_is_bounded_and_the_oldest_is_forgotten_first() -> None:
    removed = Removed()
    for i in range(2 * MAX_REMOVED):
        removed.add(guest(f"s{i}", f"i{i}"), f"n{i}", "", 0.0, 0.0, ban=True)
    assert len(removed) == MAX_REMOVED
    removed.check(guest("s0", "i0"), "n0", "", 0.0)
    with pytest.raises(Denied, match="banned"):
        removed.check(guest(f"s{2 * MAX_REMOVED - 1}"), "", "", 0.0)


def test_however_many_are_kicked_a_ban_holds() -> None:
    removed = Removed()
    removed.add(guest("bad", "b"), "bad", "", 0.0, 0.0, ban=True)
    for i in range(2 * MAX_REMOVED):
        removed.add(guest(f"s{i}", f"i{i}"), f"n{i}", "", 0.0, 0.0, ban=False)
    assert len(removed) == MAX_REMOVED
    with pytest.raises(Denied, match="banned"):
        removed.check(guest("bad"), "", "", 1.0)
    with pytest.raises(Denied, match="come back"):
        removed.check(guest(f"s{2 * MAX_REMOVED - 1}"), "", "", 1.0)


def test_who_was_kicked_is_told_how_long_and_forgotten_after_that() -> None:
    removed = Removed()
    removed.add(guest("s"), "n", "", 0.0, 0.0, ban=False)
    with pytest.raises(Denied, match="come back in 100 s"):
        removed.check(guest("s"), "", "", KICKED_FOR - 100.0)
    removed.check(guest("s"), "n", "", KICKED_FOR)
    removed.add(guest("t"), "m", "", KICKED_FOR, 0.0, ban=False)
    assert len(removed) == 1


def test_one_without_a_token_is_known_by_its_address_and_one_with_a_token_is_not() -> None:
    removed = Removed()
    removed.add(ANYBODY, "n", "1.2.3.4", 0.0, 0.0, ban=False)
    with pytest.raises(Denied):
        removed.check(ANYBODY, "other", "1.2.3.4", 0.0)
    removed.check(ANYBODY, "other", "1.2.3.5", 0.0)
    removed.check(guest("s"), "other", "1.2.3.4", 0.0)


def test_what_one_process_keeps_holds_in_the_next_whatever_the_wall_clock_does() -> None:
    kept: list[Record] = []
    first = Removed(kept.append)
    first.add(guest("kicked"), "k", "", 50.0, 1000.0, ban=False)
    first.add(guest("banned", "j"), "b", "", 50.0, 1000.0, ban=True)
    # Its monotonic clock begins elsewhere; the wall's is 100 s on, was set back, or set forward.
    for wall, left in ((1100.0, KICKED_FOR - 100.0), (-1e9, KICKED_FOR), (1e9, 0.0)):
        then = Removed()
        for removal in kept:
            assert isinstance(removal, Removal)
            then.recall(removal, 7.0, wall)
        with pytest.raises(Denied, match="banned"):
            then.check(guest("banned", "j"), "", "", 7.0 + 1e9)
        then.check(guest("kicked"), "", "", 7.0 + left)
        if left > 0.0:
            with pytest.raises(Denied, match=f"come back in {left - 1.0:.0f} s"):
                then.check(guest("kicked"), "", "", 8.0)
    # A step while it runs changes nothing for it.
    with pytest.raises(Denied, match="come back in 250 s"):
        first.check(guest("kicked"), "", "", 100.0)


def test_a_ban_holds_in_the_next_process_of_the_room(small_balloon: Balloon) -> None:
    kept: list[Record] = []

    def process() -> SessionHost:
        room_admission = RoomAdmission(None, admission(single_use=True), None, kept.append)
        room_admission.recall(list(kept), 0.0, NOW)
        body = Room(small_balloon, ServerSettings())
        return SessionHost(body, SceneBroadcast(body, model=None), room_admission)

    there = process()
    admin = say(there, watch(token=token(ADMIN, jti="admin")))
    user = say(there, hello(token=token()))
    session = welcome(user).session
    ordered(there, admin, action="ban", user=user.user)
    after = process()
    assert "banned" in refused(say(after, hello("x", token=session)), CloseCode.FORBIDDEN)
    assert "used before" in refused(
        say(after, hello("y", token=token(jti="admin"))), CloseCode.UNAUTHENTICATED
    )
    welcome(say(after, hello("honest", token=token(jti="honest"))))


def test_a_name_of_the_journal_that_is_none_is_not_told(small_balloon: Balloon) -> None:
    """Of another version, or written by hand: an administrator watches all the same."""
    there = session_host(small_balloon)
    for name in ("x" * 33, "", "two\nlines", "left"):
        line = encode(
            Removal(session="s", invitation="i", name=name, source="", at=0.0, until=None)
        )
        record = decode(line)
        assert record is not None
        there.room_admission.recall([record], 0.0, NOW)
    assert len(there.room_admission.removed) == 4
    admin = say(there, watch(token=token(ADMIN, jti="admin")))
    messages = [_decode(str(data)) for data in admin.session.take(clear=True)]
    assert messages[1:] == [PutOut(names=("left",))]


def test_who_was_banned_may_come_back_once_an_administrator_says_so(
    small_balloon: Balloon,
) -> None:
    kept: list[Record] = []
    there = session_host(small_balloon)
    there.room_admission.removed = Removed(kept.append)
    admin = say(there, watch(token=token(ADMIN, jti="admin")))
    user = say(there, hello(token=token()))
    ordered(there, admin, action="ban", user=user.user)
    there.disconnect(user, "")
    assert there.room_admission.removed.names(0.0) == ("left",)
    reported = list(admin.session.take(clear=True))
    again = say(there, hello(token=token()))
    assert "banned" in refused(again, CloseCode.FORBIDDEN)
    ordered(there, admin, action="unban", name="nobody")
    ordered(there, admin, action="unban", name="left")
    back = say(there, hello(token=token()))
    assert back.session.close is None
    heard = [_decode(m) for m in reported + admin.session.take(clear=True) if isinstance(m, str)]
    assert [m.done for m in heard if isinstance(m, Moderated)] == [True, False, True]
    # Of what waited at once only the newest was told.
    assert [m.names for m in heard if isinstance(m, PutOut)] == [("left",), ()]
    # The next process knows of both.
    assert [type(one).__name__ for one in kept] == ["Removal", "Pardon"]
    assert still_counting(kept, NOW) == []
    assert decode(encode(kept[-1])) == kept[-1]
    ordered(there, admin, action="unban")
    assert "name of one who was put out" in refused(admin, CloseCode.BAD_MESSAGE)


def test_a_ban_is_lifted_by_any_name_that_it_hits() -> None:
    kept: list[Record] = []
    removed = Removed(kept.append)
    removed.add(guest("s"), "Bill", "", 0.0, NOW, ban=True)
    with pytest.raises(Denied):
        removed.check(guest("other", "j"), "BilI", "", 1.0)
    assert removed.pardon("BilI", 1.0, NOW + 1.0)
    removed.check(guest("other", "j"), "BilI", "", 1.0)
    removed.check(guest("other", "j"), "Bill", "", 1.0)
    assert still_counting(kept, NOW + 2.0) == []
