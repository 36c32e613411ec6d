from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import CloseCode
from cohaptic_server.access.admission import ANYBODY, SESSION_LIFE
from cohaptic_server.access.keys import Denied, Grants, KeyRing
from cohaptic_server.access.tokens import LEEWAY
from tests.server.access.some import ALL, KEY, NOW, OTHER, admission, token


def test_who_has_no_token_comes_in_where_the_server_is_open_and_nowhere_else() -> None:
    assert admission(None, admits_anybody=True).admit(None, "main", NOW) == ANYBODY
    assert admission(admits_anybody=True).admit(None, "main", NOW) == ANYBODY
    with pytest.raises(Denied, match="--token") as caught:
        admission().admit(None, "main", NOW)
    assert caught.value.code is CloseCode.UNAUTHENTICATED


def test_a_server_without_keys_has_no_use_for_a_token() -> None:
    assert admission(None, admits_anybody=True).admit("rubbish", "main", NOW) == ANYBODY


def test_a_wrong_token_is_refused_also_where_anybody_comes_in() -> None:
    """Else a token that has ended would quietly be worth less."""
    with pytest.raises(Denied, match="ended"):
        admission(admits_anybody=True).admit(token(), "main", NOW + 1000.0)


def test_a_token_is_for_its_room() -> None:
    with pytest.raises(Denied, match="the room main, and this is lab-2") as caught:
        admission().admit(token(), "lab-2", NOW)
    assert caught.value.code is CloseCode.FORBIDDEN
    lab = token(ALL.model_copy(update={"room": "lab-*"}))
    assert admission().admit(lab, "lab-2", NOW).sub == "anna"


def test_one_who_may_not_join_is_refused() -> None:
    with pytest.raises(Denied, match="roomJoin"):
        admission().admit(token(Grants(room="main", can_touch=True)), "main", NOW)


def test_a_session_comes_back_when_its_invitation_has_ended_or_was_for_one_time() -> None:
    acceptor = admission(single_use=True)
    guest = acceptor.admit(token(), "main", NOW)
    acceptor.begin(guest, NOW)
    session = acceptor.session_token(guest, NOW)
    assert session is not None
    with pytest.raises(Denied, match="used before"):
        acceptor.admit(token(), "main", NOW + 1.0)
    assert acceptor.admit(session, "main", NOW + 1800.0) == guest
    assert acceptor.admit(session, "main", NOW + 1801.0) == guest
    with pytest.raises(Denied, match="ended"):
        acceptor.admit(session, "main", NOW + SESSION_LIFE + LEEWAY)


def test_a_session_ends_however_often_it_comes_back() -> None:
    acceptor = admission()
    guest, session = acceptor.admit(token(), "main", NOW), None
    for now in (NOW, NOW + 0.5 * SESSION_LIFE, NOW + SESSION_LIFE - 1.0):
        session = acceptor.session_token(guest, now)
        assert session is not None
        assert acceptor.admit(session, "main", now) == guest
    assert acceptor.session_token(guest, NOW + SESSION_LIFE) is None
    with pytest.raises(Denied):
        acceptor.admit(session, "main", NOW + SESSION_LIFE + LEEWAY)


def test_a_session_is_for_its_room_and_its_keys() -> None:
    acceptor = admission()
    session = acceptor.session_token(acceptor.admit(token(), "main", NOW), NOW)
    with pytest.raises(Denied, match="this is other"):
        acceptor.admit(session, "other", NOW)
    with pytest.raises(Denied, match="no key"):
        admission(KeyRing((OTHER,))).admit(session, "main", NOW)
    assert (
        admission(KeyRing((OTHER, KEY))).admit(session, "main", NOW).session == "name-000000000001"
    )


def test_two_invitations_begin_two_sessions_and_one_invitation_too() -> None:
    acceptor = admission()
    guests = [acceptor.admit(token(), "main", NOW) for _ in range(2)]
    assert guests[0].session != guests[1].session
    assert guests[0].invitation == guests[1].invitation == "one"


def test_nobody_without_a_token_gets_one() -> None:
    assert admission(admits_anybody=True).session_token(ANYBODY, NOW) is None
    assert admission(None).session_token(ANYBODY, NOW) is None


def test_a_token_for_one_time_is_not_used_up_by_one_who_may_not_come_in() -> None:
    acceptor = admission(single_use=True)
    with pytest.raises(Denied, match="this is other"):
        acceptor.admit(token(), "other", NOW)
    # Nor by one for whom there was no seat.
    assert acceptor.admit(token(), "main", NOW).sub == "anna"
    acceptor.begin(acceptor.admit(token(), "main", NOW), NOW)
    with pytest.raises(Denied, match="used before"):
        acceptor.admit(token(), "main", NOW)


@pytest.mark.parametrize("single_use", [True, False])
@given(
    came=st.floats(0.0, 599.0),
    valid=st.sampled_from([0.0, 1.0, 60.0, 3600.0, 2.0 * SESSION_LIFE]),
    returns=st.lists(st.floats(0.0, 3.0 * SESSION_LIFE), max_size=5).map(sorted),
)
def test_a_session_outlives_its_invitation_by_what_the_owner_says_and_no_more(
    single_use: bool, came: float, valid: float, returns: list[float]
) -> None:
    acceptor = admission(single_use=single_use, session_valid=valid)
    guest = acceptor.admit(token(), "main", NOW + came)  # it ends 600 s after NOW
    assert acceptor.ends(guest) == NOW + 600.0 + valid
    session = acceptor.session_token(guest, NOW + came)
    limit = min(600.0 + valid, came + SESSION_LIFE)
    for later in (came + r for r in returns):
        if session is None or later >= limit:
            with pytest.raises(Denied):
                acceptor.admit(session or token(), "main", NOW + max(later, limit + LEEWAY))
            return
        again = acceptor.admit(session, "main", NOW + later)
        assert again == guest
        session = acceptor.session_token(again, NOW + later)


def test_what_an_owner_says_later_holds_for_sessions_of_before() -> None:
    lenient = admission()
    guest = lenient.admit(token(), "main", NOW)
    session = lenient.session_token(guest, NOW)
    assert lenient.ends(guest) == float("inf")
    strict = admission(session_valid=60.0)
    assert strict.admit(session, "main", NOW + 659.0) == guest
    with pytest.raises(Denied, match="ended with its invitation"):
        strict.admit(session, "main", NOW + 660.0)
    # Of an earlier version, which does not say when its invitation ended, it counts from its begin.
    assert strict.ends(replace(guest, until=None)) == NOW + 60.0


def test_who_has_no_token_has_no_session_that_ends() -> None:
    acceptor = admission(admits_anybody=True, session_valid=0.0)
    assert acceptor.ends(acceptor.admit(None, "main", NOW)) == float("inf")
