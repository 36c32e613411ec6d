"""What an administrator does, and what becomes of those it is done to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import Mark, Restraints
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.protocol.watch_messages import Moderate
from cohaptic.protocol.watch_messages import decode_watch_control as _decode
from cohaptic_server.access.admission import Admission
from cohaptic_server.access.keys import Grants
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.room.moderation import FROZEN_ALONE, KICKED_FOR
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.room import RESET_AFTER
from cohaptic_server.room.session_host import SessionHost
from tests.server.access.some import ALL, NOW, admission, token
from tests.server.peers import sample
from tests.server.room.test_session_setup import (
    hello,
    refused,
    say,
    session_host,
    watch,
    watching,
    welcome,
)

PERIOD = 1.0 / 60.0
ADMIN = ALL.model_copy(update={"room_admin": True})


def ordered(there: SessionHost, admin: Peer, now: float = 0.0, **wish: Any) -> Outcome:
    return there.receive(admin, Moderate(**wish).model_dump_json(), now, NOW)


def room(body: Balloon) -> tuple[SessionHost, Peer, Peer]:
    """A room with an administrator who watches, and one who presses."""
    there = session_host(body)
    admin = say(there, watch(token=token(ADMIN, jti="admin")))
    assert watching(admin).room_admin
    user = say(there, hello(token=token()))
    return there, admin, user


def press(there: SessionHost, users: list[Peer], start: float, seconds: float) -> list[float]:
    """Forces of the first that the body carries, tick by tick, while all press."""
    felt: list[float] = []
    for k in range(int(seconds / PERIOD)):
        now = start + k * PERIOD
        for i, user in enumerate(users):
            x = 0.09 * (-1.0) ** i
            frame = sample(1 + round(now / PERIOD), (x, 0.0, 0.0), (100 * x / 4.5, 0.0, 0.0))
            answer = frame._replace(tick=there.room.world.tick)
            there.receive(user, answer.encode(), now, NOW)
        there.tick(now)
        state = there.room.world.users.get(users[0].user or 0)
        felt.append(0.0 if state is None else state.force)
    return felt


def test_one_who_is_no_administrator_is_refused_and_nothing_is_done(
    small_balloon: Balloon,
) -> None:
    there, _, user = room(small_balloon)
    guest = say(there, watch(token=token(jti="guest")))
    wishes: list[dict[str, Any]] = [
        {"action": "freeze"}, {"action": "ban", "user": user.user}, {"action": "reset"},
    ]  # fmt: skip
    for wish in wishes:
        ordered(there, guest, **wish)
        assert "roomAdmin" in refused(guest, CloseCode.FORBIDDEN)
        guest = say(there, watch(token=token(jti="guest")), source=str(wish))
    assert not there.room.frozen
    assert len(there.room_admission.removed) == 0
    assert user.session.close is None


def test_who_is_muted_fades_smoothly_keeps_its_patches_and_comes_back(
    small_balloon: Balloon,
) -> None:
    there, admin, user = room(small_balloon)
    before = press(there, [user], 0.0, 1.0)
    assert before[-1] > 1.0
    ordered(there, admin, action="mute", user=user.user)
    felt = [before[-1], *press(there, [user], 1.0, 1.0)]
    assert felt[-1] < 1e-3
    assert max(abs(np.diff(felt))) < 0.25 * before[-1]
    assert user.user in there.room.patches
    ordered(there, admin, action="unmute", user=user.user)
    assert press(there, [user], 2.0, 1.0)[-1] == pytest.approx(before[-1], rel=0.01)


@pytest.mark.parametrize("ban", [False, True])
def test_who_is_put_out_hears_why_and_comes_back_refused(small_balloon: Balloon, ban: bool) -> None:
    there, admin, user = room(small_balloon)
    session = welcome(user).session
    page = say(there, watch(token=session))
    other = say(there, hello("other", token=token(jti="other")))
    ordered(there, admin, action="ban" if ban else "kick", user=user.user)
    # All connections of its session, and nobody else's.
    for peer in (user, page):
        assert "this room" in refused(peer, CloseCode.FORBIDDEN)
        there.disconnect(peer, "")
    assert other.session.close is None
    assert admin.session.close is None
    assert list(there.room.members) == [other.user]
    refused(say(there, hello("another", token=session)), CloseCode.FORBIDDEN)
    refused(say(there, watch(token=session), source="b"), CloseCode.FORBIDDEN)
    refused(say(there, hello("left", token=token(jti="new")), source="c"), CloseCode.FORBIDDEN)
    # A ban takes the invitation with it.
    again = say(there, hello("fresh", token=token()), source="d")
    assert (again.session.close is not None) == ban
    welcome(say(there, hello("honest", token=token(jti="honest")), source="e"))


def test_who_was_kicked_may_come_back_later_and_who_was_banned_may_not(
    small_balloon: Balloon,
) -> None:
    for action, code in (("kick", None), ("ban", CloseCode.FORBIDDEN)):
        there, admin, user = room(small_balloon)
        session = welcome(user).session
        ordered(there, admin, action=action, user=user.user)
        there.disconnect(user, "")
        peer = there.connect(KICKED_FOR, SUBPROTOCOL, None, "z")
        there.receive(peer, hello(token=session).model_dump_json(), KICKED_FOR, NOW - KICKED_FOR)
        if code is None:
            welcome(peer)
        else:
            assert "banned" in refused(peer, code)


def test_of_a_ban_nobody_suffers_who_came_before_with_the_same_invitation(
    small_balloon: Balloon,
) -> None:
    there = session_host(small_balloon, admission())
    admin = say(there, watch(token=token(ADMIN, jti="admin")))
    friend = say(there, hello("friend", token=token()))
    session = welcome(friend).session
    villain = say(there, hello("villain", token=token()), source="v")
    there.receive(admin, Moderate(action="ban", user=villain.user).model_dump_json(), 1.0, NOW)
    assert friend.session.close is None
    assert welcome(say(there, hello("friend", token=session))).name == "friend"


def test_a_frozen_body_takes_nobodys_force_and_comes_back(small_balloon: Balloon) -> None:
    there, admin, user = room(small_balloon)
    before = press(there, [user], 0.0, 1.0)[-1]
    ordered(there, admin, action="freeze")
    assert press(there, [user], 1.0, 1.0)[-1] < 1e-3
    ordered(there, admin, action="unfreeze")
    assert press(there, [user], 2.0, 1.0)[-1] == pytest.approx(before, rel=0.01)


def test_a_reset_fades_all_forces_first_and_ticks_go_on(small_balloon: Balloon) -> None:
    there, admin, user = room(small_balloon)
    before = press(there, [user], 0.0, 1.0)
    tick = there.room.world.tick
    ordered(there, admin, now=1.0, action="reset")
    felt = [before[-1], *press(there, [user], 1.0, RESET_AFTER + 1.0)]
    assert min(felt) < 1e-3
    assert max(abs(np.diff(felt))) < 0.25 * before[-1]
    assert felt[-1] == pytest.approx(before[-1], rel=0.05)
    assert there.room.world.tick == tick + len(felt) - 1


def test_all_together_give_no_more_than_the_rooms_budget_and_the_strong_one_pays(
    small_balloon: Balloon,
) -> None:
    there, admin, user = room(small_balloon)
    other = say(there, hello("right", token=token(jti="other")))
    ordered(there, admin, action="force_budget", force=1.5)
    press(there, [user, other], 0.0, 2.0)
    forces = [state.force for state in there.room.world.users.values()]
    assert sum(forces) <= 1.5 + 1e-6
    assert min(forces) > 0.5
    ordered(there, admin, action="force_budget")
    press(there, [user, other], 2.0, 2.0)
    assert sum(state.force for state in there.room.world.users.values()) > 3.0


def test_one_who_has_left_is_passed_over_and_a_wish_without_one_is_refused(
    small_balloon: Balloon,
) -> None:
    there, admin, _ = room(small_balloon)
    ordered(there, admin, action="kick", user=99)
    assert admin.session.close is None
    ordered(there, admin, action="kick")
    assert "the number of the user to kick" in refused(admin, CloseCode.BAD_MESSAGE)


def report(peer: Peer) -> list[Restraints]:
    """What a peer hears of restraints."""
    said = [m for m in peer.session.take(clear=True) if isinstance(m, str)]
    kind = '"type":"restraints"'
    return [r for text in said if kind in text and isinstance(r := _decode(text), Restraints)]


def test_all_hear_who_is_muted_and_that_the_body_is_frozen_and_who_comes_later_too(
    small_balloon: Balloon,
) -> None:
    there, admin, user = room(small_balloon)
    welcome(user)
    assert user.user is not None
    steps: list[tuple[dict[str, Any], Restraints]] = [
        ({"action": "mute", "user": user.user}, Restraints(muted=(user.user,))),
        ({"action": "freeze"}, Restraints(frozen=True, muted=(user.user,))),
        ({"action": "unmute", "user": user.user}, Restraints(frozen=True)),
    ]
    for wish, expected in steps:
        ordered(there, admin, **wish)
        assert report(user)[-1] == report(admin)[-1] == expected
    later = say(there, watch(token=token(jti="later")))
    assert report(later) == [Restraints(frozen=True)]
    ordered(there, admin, action="unfreeze")
    assert report(later) == [Restraints()]
    assert report(say(there, watch(token=token(jti="last")))) == []


def test_who_is_muted_stays_muted_by_coming_back_and_by_another_name(
    small_balloon: Balloon,
) -> None:
    there, admin, user = room(small_balloon)
    session = welcome(user).session
    ordered(there, admin, action="mute", user=user.user)
    for name in ("left", "another"):
        there.disconnect(user, "bye")
        user = say(there, hello(name, token=session))
        assert press(there, [user], 0.0, 0.5)[-1] == 0.0
        assert report(user) == report(admin)[-1:] == [Restraints(muted=(user.user or 0,))]
    ordered(there, admin, action="unmute", user=user.user)
    assert press(there, [user], 2.0, 1.0)[-1] > 1.0


def test_a_freeze_is_handed_to_who_administers_and_ends_when_nobody_does_for_long(
    small_balloon: Balloon,
) -> None:
    there, admin, user = room(small_balloon)
    second = say(there, watch(token=token(ADMIN, jti="second")))
    ordered(there, admin, action="freeze")
    there.disconnect(admin, "")
    there.serve(1.0)
    there.serve(10.0 * FROZEN_ALONE)
    assert there.room.frozen  # the other has it
    there.disconnect(second, "")
    there.serve(10.0 * FROZEN_ALONE + 1.0)
    there.serve(11.0 * FROZEN_ALONE - 1.0)
    assert there.room.frozen
    user.session.take(clear=True)
    there.serve(11.0 * FROZEN_ALONE + 1.0)
    assert not there.room.frozen
    texts = [m for m in user.session.take(clear=True) if isinstance(m, str)]
    assert Restraints() in [_decode(m) for m in texts]
    # One that begins later is counted from its own beginning.
    third = say(there, watch(token=token(ADMIN, jti="third")))
    ordered(there, third, action="freeze", now=20.0 * FROZEN_ALONE)
    there.disconnect(third, "")
    there.serve(20.0 * FROZEN_ALONE)
    there.serve(20.5 * FROZEN_ALONE)
    assert there.room.frozen


def test_an_earlier_freeze_does_not_shorten_a_later_one(small_balloon: Balloon) -> None:
    there, admin, _ = room(small_balloon)
    ordered(there, admin, action="freeze")
    there.serve(1.0)
    ordered(there, admin, action="unfreeze", now=2.0)
    there.disconnect(admin, "")
    there.serve(3.0)
    # As the command line does: it orders, and its connection ends before the next tick.
    second = say(there, watch(token=token(ADMIN, jti="second")))
    ordered(there, second, action="freeze", now=20.0 * FROZEN_ALONE)
    there.disconnect(second, "")
    there.serve(20.0 * FROZEN_ALONE + 1.0)
    assert there.room.frozen


@pytest.mark.parametrize("grant", ["room_admin", "room_record"])
def test_who_may_record_asks_the_shell_to_begin_and_to_end(
    grant: str, small_balloon: Balloon
) -> None:
    there = session_host(small_balloon, recordings="folder")
    grants = ALL.model_copy(update={grant: True})
    admin = say(there, watch(token=token(grants, jti="recorder")))
    assert watching(admin).can_record
    for action, on in (("record", True), ("end_recording", False)):
        assert ordered(there, admin, action=action).recordings == [(admin, on)]
    assert admin.session.close is None


@pytest.mark.parametrize("action", ["record", "end_recording"])
@pytest.mark.parametrize(
    ("grants", "folder", "why"), [(ALL, "folder", "roomRecord"), (ADMIN, "", "--recordings")]
)
def test_a_recording_needs_a_grant_and_a_folder(
    action: str, grants: Grants, folder: str, why: str, small_balloon: Balloon
) -> None:
    there = session_host(small_balloon, recordings=folder)
    guest = say(there, watch(token=token(grants, jti="guest")))
    assert not watching(guest).can_record
    assert ordered(there, guest, action=action).recordings == []
    assert why in refused(guest, CloseCode.FORBIDDEN)


@pytest.mark.parametrize("folder", ["", "folder"])
def test_who_gave_no_token_is_told_so_and_the_ways_to_a_recording(
    folder: str, small_balloon: Balloon
) -> None:
    there = session_host(small_balloon, Admission(), recordings=folder)
    guest = say(there, watch())
    assert ordered(there, guest, action="record").recordings == []
    said = refused(guest, CloseCode.FORBIDDEN)
    for words in ("needs a token", "roomRecord", "--record", "cohaptic.record("):
        assert words in said
    assert "invitation" not in said


def test_who_watches_sets_marks_only_where_it_may_touch(small_balloon: Balloon) -> None:
    there = session_host(small_balloon)
    mark = Mark(text="stimulus on")
    for may, jti in ((True, "a"), (False, "b")):
        grants = ALL.model_copy(update={"can_touch": may})
        peer = say(there, watch(token=token(grants, jti=jti)))
        outcome = there.receive(peer, mark.model_dump_json(), 0.0, NOW)
        assert outcome.marks == ([(mark, None)] if may else [])
        assert (peer.session.close is None) == may
