"""What an administrator does in a room, over a connection that watches. No I/O."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.watch_messages import Moderate, Moderated
from cohaptic_server.access.denied import forbidden
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.removed import Removed
from cohaptic_server.room.room import Room

_RESTRAINTS = ("mute", "unmute", "freeze", "unfreeze")


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
    """Carry out the wish of an administrator, or end the session of one who is none.

    Args:
        room: Of which it is.
        peers: All of the room.
        removed: To which those who are put out are added.
        admin: Whose wish it is.
        wish: What is to be done.
        now: Time [s].
        to_wall: Offset of that time to the machine's wall clock [s].
        outcome: To which the tasks of the shell are added.
    """
    if not admin.guest.grants.room_admin:
        admin.session.fail(forbidden("the token does not let you administer the room (roomAdmin)"))
        return
    action = wish.action
    if action in ("freeze", "unfreeze"):
        room.frozen = action == "freeze"
    elif action == "reset":
        room.reset(now)
    elif action == "force_budget":
        room.force_budget = wish.force
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
    whom = "" if wish.user is None else f" of {room.name_of(wish.user)}"
    outcome.say("moderated", f"{admin.guest.sub}: {action}{whom}", admin.source)


def tell_restraints(room: Room, peers: Iterable[Peer], outcome: Outcome) -> None:
    """Tell peers what the body takes of nobody, or not of all."""
    restraints = room.restraints
    for peer in peers:
        if peer.session.hears_news:
            peer.session.send(restraints)
            outcome.flush.append(peer)


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
    """End every connection of a user's session, and keep it out."""
    (offender,) = [peer for peer in peers if peer.user == user]
    guest = offender.guest
    removed.add(guest, name, offender.source, now, now + to_wall, ban=ban)
    words = "you were banned from this room" if ban else "you were put out of this room"
    for peer in peers:
        same = guest.session != "" and peer.guest.session == guest.session
        if peer is offender or same:
            peer.session.fail(forbidden(words))
            outcome.flush.append(peer)
