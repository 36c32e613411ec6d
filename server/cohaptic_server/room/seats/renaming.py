"""Another name for one who touches or waits, without leaving: its seat stays. No I/O."""

from __future__ import annotations

from collections.abc import Iterable

from cohaptic.errors import CloseCode, ProtocolError, RemoteProtocolError
from cohaptic.protocol.control.naming import Named, SetName
from cohaptic.protocol.messages import UserJoined
from cohaptic_server.room.entrance import Entrance
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.seats.names import Claim
from cohaptic_server.room.seats.waiting import Waiting


def rename(
    room: Room,
    waiting: Waiting,
    entrance: Entrance,
    peers: Iterable[Peer],
    peer: Peer,
    wish: SetName,
    now: float,
    outcome: Outcome,
) -> None:
    """Have somebody go by another name, or tell why it does not.

    Args:
        room: Room of which it is, or before which it waits.
        waiting: Who waits.
        entrance: Entrance of the room; names of those who were put out are nobody's.
        peers: All of the room.
        peer: Whose wish it is.
        wish: The name.
        now: Time [s].
        outcome: To which the tasks of the shell are added.

    Raises:
        RemoteProtocolError: So many names come from its address that they are counted as a flood.
    """
    member = None if peer.user is None else room.members[peer.user]
    hello = waiting.hello_of(peer) if member is None else member.hello
    if hello is None:
        return
    before = hello.name
    if wish.name == before:
        peer.session.send(Named(name=before))
        return
    entrance.sources.join(peer.source, now)  # each is news for everybody, as one who joins
    claim = Claim(hello.key, peer.source, peer.guest.session)
    try:
        _check(room, waiting, entrance, peer, wish.name, claim, now)
    except ProtocolError as error:
        peer.session.send(Named(name=before, reason=str(error)))
        return
    if member is None:
        waiting.rename(peer, wish.name)
    else:
        room.kept.forget(wish.name, claim)
        member.hello = hello.model_copy(update={"name": wish.name})
        if member.muted:
            room.muted.add(wish.name, claim)
        for other in peers:
            if other is not peer and other.session.hears_news:
                other.session.send(UserJoined(user=member.user, name=wish.name))
                outcome.flush.append(other)
    peer.session.send(Named(name=wish.name))
    told = f"{before} goes by the name {wish.name}"
    outcome.say("renamed", told, peer.source, user=wish.name)


def _check(
    room: Room,
    waiting: Waiting,
    entrance: Entrance,
    peer: Peer,
    name: str,
    claim: Claim,
    now: float,
) -> None:
    room.check_name(name, [peer.user])
    if waiting.has_name(name, peer):
        limit = "another one: somebody waits by that name"
        raise RemoteProtocolError("name", name, limit, CloseCode.NAME_TAKEN)
    room.kept.check(name, claim, now)
    entrance.removed.check(peer.guest, name, peer.source, now)
