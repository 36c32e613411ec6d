"""Moderation of a room: an administrator's actions, and the users who were removed. No I/O.

An administrator acts over a watching connection. The list of removed users has bounded length; each
entry has the time at which the user may come back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from pydantic import TypeAdapter, ValidationError

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.control.message import Name
from cohaptic.protocol.watch_messages import MAX_PUT_OUT, Moderate, Moderated, PutOut
from cohaptic_server.access.admission import Guest
from cohaptic_server.access.keys import forbidden
from cohaptic_server.access.remembered import MAX_REMOVED, Pardon, Record, Removal
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.seats.names import looks_like

_NAME: TypeAdapter[str] = TypeAdapter(Name)
KICKED_FOR = 300.0  # s; enough for the user to calm down and to be told the reason


class Removed:
    """The users who may not come back into one room.

    Args:
        keep: Function that stores each removal and pardon for later server processes; None if
            nothing is stored.
    """

    def __init__(self, keep: Callable[[Record], None] | None = None) -> None:
        self._keep = keep
        # Each removal with its end on the clock of this process [s], so that a step of the wall
        # clock changes no removal while the process runs.
        self._removals: list[tuple[Removal, float]] = []

    def __len__(self) -> int:
        return len(self._removals)

    def recall(self, removal: Removal, now: float, wall: float) -> None:
        """Apply a removal that an earlier server process has stored.

        Args:
            removal: Record of the earlier process.
            now: Time [s].
            wall: Unix time [s].
        """
        if removal.until is None:
            self._add(removal, float("inf"), now)
        elif removal.counts(wall):
            # A kick ends within KICKED_FOR even if the wall clock was set back meanwhile.
            self._add(removal, now + min(removal.until - wall, KICKED_FOR), now)

    def add(
        self, guest: Guest, name: str, source: str, now: float, wall: float, *, ban: bool
    ) -> None:
        """Keep a user out of the room, for `KICKED_FOR` or for good.

        Args:
            guest: Identity of the user.
            name: Name of the user in the room.
            source: Network address of the user's connection; compared only for users without a
                token.
            now: Time [s].
            wall: Unix time [s].
            ban: Whether the user is kept out for good.
        """
        removal = Removal(
            session=guest.session,
            invitation=guest.invitation,
            name=name,
            source=source,
            at=wall,
            until=None if ban else wall + KICKED_FOR,
        )
        self._add(removal, float("inf") if ban else now + KICKED_FOR, now)
        if self._keep is not None:
            self._keep(removal)

    def pardon(self, name: str, now: float, wall: float) -> bool:
        """Let all users come back who were removed under a name; return whether there were any.

        Args:
            name: Name that the users had in the room, or a name that looks like it, since such a
                name is kept out as well.
            now: Time [s].
            wall: Unix time [s].
        """
        pardoned = [one for one in self._removals if looks_like(one[0].name, name)]
        if not any(until > now for _, until in pardoned):
            return False
        self._removals = [one for one in self._removals if one not in pardoned]
        if self._keep is not None:
            for written in dict.fromkeys(one.name for one, _ in pardoned):
                self._keep(Pardon(name=written, at=wall))
        return True

    def names(self, now: float) -> tuple[str, ...]:
        """Return the names of the users who may not come back yet, each name once, the newest last.

        Invalid names, which no message could carry, are omitted. A journal may contain them if
        another version wrote it or if it was edited by hand.
        """
        names = (one.name for one, until in self._removals if until > now)
        return tuple(dict.fromkeys(name for name in names if _is_name(name)))

    def _add(self, removal: Removal, until: float, now: float) -> None:
        counting = [one for one in self._removals if one[1] > now]
        if len(counting) >= MAX_REMOVED:
            # Drop the oldest kick, which would end anyway; drop a ban only if all are bans.
            kicks = [k for k, (_, until) in enumerate(counting) if until < float("inf")]
            del counting[kicks[0] if kicks else 0]
        self._removals = [*counting, (removal, until)]

    def check(self, guest: Guest, name: str, source: str, now: float) -> None:
        """Raise Denied if a user was removed from the room and may not come back yet.

        Args:
            guest: Identity of the user.
            name: Name that the user wants to have in the room; empty for a watcher.
            source: Network address of the user's connection.
            now: Time [s].
        """
        for one, until in self._removals:
            if now < until and _is_same(one, guest, name, source):
                if one.until is None:
                    raise forbidden("you were banned from this room")
                wait = f"you may come back in {until - now:.0f} s"
                raise forbidden("you were put out of this room", wait)


def _is_name(text: str) -> bool:
    try:
        _NAME.validate_python(text)
    except ValidationError:
        return False
    return True


def _is_same(one: Removal, guest: Guest, name: str, source: str) -> bool:
    if name and looks_like(name, one.name):
        return True
    if not one.session:
        return not guest.session and source == one.source
    if guest.session == one.session:
        return True
    # A ban also covers the user's invitation, except sessions that began with it before the ban.
    banned = one.until is None
    return banned and guest.invitation == one.invitation and guest.since >= one.at


FROZEN_ALONE = 600.0  # s for which the object stays frozen without an administrator in the room
_RESTRAINTS = ("mute", "unmute", "freeze", "unfreeze")


# Above 60 lines: each action has its branch, and all of them share one ending.
def moderate(
    room: Room,
    peers: Sequence[Peer],
    removed: Removed,
    admin: Peer,
    wish: Moderate,
    now: float,
    to_wall: float,
    outcome: Outcome,
) -> None:
    """Carry out an administrator's action, or end the session of a peer that is no administrator.

    Args:
        peers: All peers of the room.
        removed: List to which removed users are added.
        admin: Peer that asks for the action.
        wish: Message with the action.
        now: Time [s].
        to_wall: Time on the machine's wall clock minus `now` [s].
        outcome: Receives the tasks of the shell.
    """
    if wish.action in ("record", "end_recording"):
        _change_recording(room, admin, outcome, on=wish.action == "record")
        return
    if not admin.guest.grants.room_admin:
        admin.session.fail(forbidden("the token does not let you administer the room (roomAdmin)"))
        return
    action = wish.action
    if action in ("freeze", "unfreeze"):
        room.frozen = action == "freeze"
        room.left_alone = None  # a freeze is counted from its own beginning
    elif action == "reset":
        room.reset(now)
    elif action == "force_budget":
        room.force_budget = wish.force
    elif action == "unban":
        if wish.name is None:
            limit = "the name of one who was put out"
            admin.session.fail(RemoteProtocolError("name", None, limit))
            return
        if not removed.pardon(wish.name, now, now + to_wall):
            admin.session.send(Moderated(action=action, user=None, done=False))
            return
    elif wish.user is None:
        limit = f"the number of the user to {action}"
        admin.session.fail(RemoteProtocolError("user", None, limit))
        return
    else:
        member = room.members.get(wish.user)
        if member is None:
            admin.session.send(Moderated(action=action, user=wish.user, done=False))
            return
        if action in ("mute", "unmute"):
            member.muted = action == "mute"
            change = room.muted.add if member.muted else room.muted.take_out
            change(member.hello.name, member.claim)
        else:
            ban = action == "ban"
            _put_out(peers, removed, wish.user, member.hello.name, now, to_wall, outcome, ban=ban)
    admin.session.send(Moderated(action=action, user=wish.user, done=True))
    if action in _RESTRAINTS:
        tell_restraints(room, peers, outcome)
    if action in ("kick", "ban", "unban"):
        tell_put_out(removed, [peer for peer in peers if administers(peer)], now, outcome)
    whom = "" if wish.user is None else f" of {room.name_of(wish.user)}"
    whom = whom if wish.name is None else f" of {wish.name}"
    outcome.say("moderated", f"{admin.guest.sub}: {action}{whom}", admin.source)


def tell_restraints(room: Room, peers: Iterable[Peer], outcome: Outcome) -> None:
    """Tell peers whether the body is frozen (takes no forces), and which users are muted."""
    restraints = room.restraints
    for peer in peers:
        if peer.session.hears_news:
            peer.session.send(restraints)
            outcome.flush.append(peer)


def administers(peer: Peer) -> bool:
    """Whether a peer is an accepted watcher with the right to administer the room."""
    return peer.watches and peer.session.hears_news and peer.guest.grants.room_admin


def tell_put_out(removed: Removed, admins: Iterable[Peer], now: float, outcome: Outcome) -> None:
    """Tell administrators the names of the removed users who may not come back yet."""
    names = removed.names(now)[-MAX_PUT_OUT:]
    for admin in admins:
        admin.session.send(PutOut(names=names))
        outcome.flush.append(admin)


def end_freeze(room: Room, peers: Iterable[Peer], now: float, outcome: Outcome) -> None:
    """Unfreeze the frozen body after `FROZEN_ALONE` seconds without an administrator in the room.

    A freeze lasts while any administrator is in the room, even if another one ordered it. It
    outlasts the last administrator for a while, because a connection may be lost, and an order from
    the command line does not keep its connection. Without the time limit, a body could stay frozen
    with nobody there who may unfreeze it.

    Args:
        room: Room whose body is frozen.
        peers: All peers of the room.
        now: Time [s].
        outcome: Receives the tasks of the shell.
    """
    peers = list(peers)
    if any(administers(peer) for peer in peers):
        room.left_alone = now
    elif room.left_alone is None:
        room.left_alone = now
    elif now - room.left_alone >= FROZEN_ALONE:
        room.frozen, room.left_alone = False, None
        tell_restraints(room, peers, outcome)
        outcome.say("thawed", "the object takes forces again: no administrator is here")


# Without a token no server lets anybody begin a recording here, with --recordings or without.
_TO_RECORD = (
    "give one of `cohaptic token --record`; of a server that takes no tokens, record by"
    " `cohaptic serve --record FILE`, or by cohaptic.record(...) in a script on its machine"
)


def _change_recording(room: Room, admin: Peer, outcome: Outcome, *, on: bool) -> None:
    if not admin.guest.grants.may_record and not admin.guest.session:
        needed = "a recording needs a token that allows it (roomRecord or roomAdmin)"
        admin.session.fail(forbidden(needed, _TO_RECORD))
    elif not admin.guest.grants.may_record:
        admin.session.fail(forbidden("the token does not let you record (roomRecord or roomAdmin)"))
    elif not room.settings.recordings:
        admin.session.fail(forbidden("the server has no folder for recordings (--recordings)"))
    else:
        outcome.recordings.append((admin, on))
        words = f"{admin.guest.sub} {'begins' if on else 'ends'} a recording"
        outcome.say("moderated", words, admin.source)


def _put_out(
    peers: Sequence[Peer],
    removed: Removed,
    user: int,
    name: str,
    now: float,
    to_wall: float,
    outcome: Outcome,
    *,
    ban: bool,
) -> None:
    """End all connections of a user's session, and keep the user out of the room."""
    (offender,) = [peer for peer in peers if peer.user == user]
    guest = offender.guest
    removed.add(guest, name, offender.source, now, now + to_wall, ban=ban)
    words = "you were banned from this room" if ban else "you were put out of this room"
    for peer in peers:
        same = guest.session != "" and peer.guest.session == guest.session
        if peer is offender or same:
            peer.session.fail(forbidden(words))
            outcome.flush.append(peer)
