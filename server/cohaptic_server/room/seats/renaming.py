"""Changes the name of a client, which keeps its seat or its place in the queue. No I/O."""

from __future__ import annotations

from collections.abc import Iterable

from cohaptic.errors import CloseCode, ProtocolError, RemoteProtocolError
from cohaptic.protocol.control.message import Named, SetName
from cohaptic.protocol.messages import UserJoined
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.seats.names import Claim
from cohaptic_server.room.seats.waiting import Waiting
from cohaptic_server.room.session_setup import RoomAdmission


def rename(
    room: Room,
    waiting: Waiting,
    room_admission: RoomAdmission,
    peers: Iterable[Peer],
    peer: Peer,
    wish: SetName,
    now: float,
    outcome: Outcome,
) -> None:
    """Change the name of a client, or tell the client why its old name stays.

    Args:
        room: Room that the client is in or waits for.
        waiting: Clients that wait for a seat.
        room_admission: RoomAdmission of the room, which refuses the name of a removed user.
        peers: All peers of the room.
        peer: Client that wants another name.
        wish: Message with the new name.
        now: Time [s].
        outcome: Receives the tasks of the shell.

    Raises:
        RemoteProtocolError: The client's address has exceeded the rate limit of joins; a change of
            name counts as a join.
    """
    member = None if peer.user is None else room.members[peer.user]
    hello = waiting.hello_of(peer) if member is None else member.hello
    if hello is None:
        return
    before = hello.name
    if wish.name == before:
        peer.session.send(Named(name=before))
        return
    room_admission.sources.join(peer.source, now)  # a new name is news for everybody, like a join
    claim = Claim(hello.key, peer.source, peer.guest.session)
    try:
        _check(room, waiting, room_admission, peer, wish.name, claim, now)
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
                other.session.send(
                    UserJoined(user=member.user, name=wish.name, rules=member.hello.rules)
                )
                outcome.flush.append(other)
    peer.session.send(Named(name=wish.name))
    sentence = f"{before} goes by the name {wish.name}"
    outcome.say("renamed", sentence, peer.source, user=wish.name)


def _check(
    room: Room,
    waiting: Waiting,
    room_admission: RoomAdmission,
    peer: Peer,
    name: str,
    claim: Claim,
    now: float,
) -> None:
    room.check_name(name, [peer.user])
    if waiting.has_name(name, peer):
        limit = "another one: somebody who waits for a seat has it"
        raise RemoteProtocolError("name", name, limit, CloseCode.NAME_TAKEN)
    room.kept.check(name, claim, now)
    room_admission.removed.check(peer.guest, name, peer.source, now)
