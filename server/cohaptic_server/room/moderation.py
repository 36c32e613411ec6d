"""Actions of an administrator in a room, over a watching connection. No I/O."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.watch_messages import MOST_PUT_OUT, Moderate, Moderated, PutOut
from cohaptic_server.access.denied import forbidden
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.removed import Removed
from cohaptic_server.room.room import Room

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
    """Carry out an administrator's action, or end the session of a peer without that right.

    Args:
        peers: All peers of the room.
        removed: Receives the users who are put out.
        admin: Peer that asks for the action.
        wish: Message with the action.
        now: Time [s].
        to_wall: Time on the machine's wall clock minus `now` [s].
        outcome: Receives the tasks of the shell.
    """
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
    """Tell peers whether the body is frozen, and which users are muted."""
    restraints = room.restraints
    for peer in peers:
        if peer.session.hears_news:
            peer.session.send(restraints)
            outcome.flush.append(peer)


def administers(peer: Peer) -> bool:
    """Whether a peer watches and may administer the room."""
    return peer.watches and peer.session.hears_news and peer.guest.grants.room_admin


def tell_put_out(removed: Removed, admins: Iterable[Peer], now: float, outcome: Outcome) -> None:
    """Tell administrators the names of the users who may not come back."""
    names = removed.names(now)[-MOST_PUT_OUT:]
    for admin in admins:
        admin.session.send(PutOut(names=names))
        outcome.flush.append(admin)


def end_freeze(room: Room, peers: Iterable[Peer], now: float, outcome: Outcome) -> None:
    """Unfreeze the object after `FROZEN_ALONE` without an administrator; called while frozen.

    A freeze lasts while any administrator is in the room, even if another one ordered it. The
    freeze outlasts the last administrator for a while, because a connection may be lost, and an
    order from the command line does not keep its connection. Without the time limit, nobody might
    be left to unfreeze the object.

    Args:
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
    """End every connection of a user's session, and keep the user out."""
    (offender,) = [peer for peer in peers if peer.user == user]
    guest = offender.guest
    removed.add(guest, name, offender.source, now, now + to_wall, ban=ban)
    words = "you were banned from this room" if ban else "you were put out of this room"
    for peer in peers:
        same = guest.session != "" and peer.guest.session == guest.session
        if peer is offender or same:
            peer.session.fail(forbidden(words))
            outcome.flush.append(peer)
