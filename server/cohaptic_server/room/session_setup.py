"""Decides which clients come into a room as users or watchers. No I/O.

The room admission of a room checks the rate limit of joins, the token and its grants.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from cohaptic.errors import CloseCode, ProtocolError, RemoteProtocolError
from cohaptic.protocol.messages import (
    Hello,
    Recorded,
    ServerControl,
    UserJoined,
    UserLeft,
    Welcome,
)
from cohaptic.protocol.watch_messages import Watch
from cohaptic.room_address import MAIN
from cohaptic_server.access.admission import Admission
from cohaptic_server.access.keys import forbidden
from cohaptic_server.access.remembered import Record, Removal, Used
from cohaptic_server.guard.limits import Limits
from cohaptic_server.guard.sources import Sources
from cohaptic_server.room.life import Event
from cohaptic_server.room.moderation import Removed, administers, tell_put_out, tell_restraints
from cohaptic_server.room.peer import Outcome, Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.seats.names import Claim
from cohaptic_server.room.seats.waiting import Waiting
from cohaptic_server.room.session import ServerSession
from cohaptic_server.room.watch.scene_broadcast import SceneBroadcast
from cohaptic_server.room.watch.watcher import Watcher


class RoomAdmission:
    """Decides by rate limit, token and removals whether a client may come into a room.

    Args:
        sources: Rate limits of the network addresses.
        admission: The server's check of tokens; None if everybody may come in.
        room: Name of the room; None for the name of the main room.
        keep: Function that stores records which must outlive this process; None if nothing is
            stored.

    Attributes:
        removed: Users whom an administrator has removed from the room.
    """

    def __init__(
        self,
        sources: Sources | None = None,
        admission: Admission | None = None,
        room: str | None = None,
        keep: Callable[[Record], None] | None = None,
    ) -> None:
        self.sources = Sources(Limits()) if sources is None else sources
        self.admission = Admission() if admission is None else admission
        self.room = room or MAIN
        self.removed = Removed(keep)
        if keep is not None:
            self.admission.keep = keep

    def recall(self, records: Iterable[Record], now: float, to_wall: float) -> None:
        """Take over the records that earlier server processes have stored.

        Args:
            records: Removals of users, and invitations that were used.
            now: Time [s].
            to_wall: Time on the machine's wall clock minus `now` [s].
        """
        for record in records:
            if isinstance(record, Removal):
                self.removed.recall(record, now, now + to_wall)
            elif isinstance(record, Used):
                self.admission.recall(record)

    def enter(self, peer: Peer, first: Hello | Watch, now: float, to_wall: float) -> str | None:
        """Identify a client by its token, and let the client in.

        Args:
            peer: Peer that has sent its first message; the method sets its `guest` and `ends`.
            first: First message of the peer.
            now: Time [s].
            to_wall: Time on the machine's wall clock minus `now` [s].

        Returns:
            Token with which the client can come back; None if the client needs no token.

        Raises:
            RemoteProtocolError: The client may not come in.
        """
        # The join is counted before the token is checked, so that a flood of wrong tokens is
        # bounded.
        self.sources.join(peer.source, now)
        wall = now + to_wall
        guest = self.admission.admit(first.token, self.room, wall)
        grants = guest.grants
        if isinstance(first, Hello) and not grants.can_touch:
            also = "you may watch" if grants.can_view else "ask the owner of the room for another"
            raise forbidden("the token does not let you touch (canTouch)", also)
        if isinstance(first, Watch) and not grants.can_view:
            raise forbidden("the token does not let you watch (canView)")
        peer.guest = guest
        peer.ends = now + (self.admission.ends(guest) - wall)
        return self.check(peer, first.name if isinstance(first, Hello) else "", now, to_wall)

    def begin(self, peer: Peer, now: float, to_wall: float) -> None:
        """Count a client's invitation as used, after it got a seat or a place in the queue."""
        self.admission.begin(peer.guest, now + to_wall)

    def check(self, peer: Peer, name: str, now: float, to_wall: float) -> str | None:
        """Refuse a removed user; return a token for coming back.

        This is the part of `enter` that is repeated for a client that has waited for a seat.

        Args:
            peer: Peer whose `guest` is known.
            name: Name that the client wants to have as a user; empty for a watcher.
            now: Time [s].
            to_wall: Time on the machine's wall clock minus `now` [s].

        Returns:
            Token with which the client can come back; None if the client needs no token.

        Raises:
            RemoteProtocolError: An administrator has removed the client from the room.
        """
        self.removed.check(peer.guest, name, peer.source, now)
        return self.admission.session_token(peer.guest, now + to_wall)


# Watching connections of one session. A page has one; further ones come from duplicated tabs, and
# from broken paths whose end the server does not know yet.
MAX_PAGES = 4


class SessionSetup:
    """Makes peers users or watchers of one room.

    Args:
        room: Room with the users.
        scene_broadcast: Watchers of the room.
        room_admission: RoomAdmission that checks tokens and grants.
        peers: All peers of the room; the list that the session host maintains.

    Attributes:
        waiting: Clients that wait for a seat.
    """

    def __init__(
        self,
        room: Room,
        scene_broadcast: SceneBroadcast,
        room_admission: RoomAdmission,
        peers: Sequence[Peer],
    ) -> None:
        self.room, self.scene_broadcast, self.room_admission = room, scene_broadcast, room_admission
        self.peers = peers
        self.waiting = Waiting(room)

    def join(
        self,
        peer: Peer,
        session: ServerSession,
        hello: Hello,
        now: float,
        to_wall: float,
        outcome: Outcome,
    ) -> None:
        """Make a client a user, let it wait for a seat, or end its session.

        Args:
            peer: Peer that has sent its hello.
            session: Protocol session of the peer.
            hello: First message of the peer.
            now: Time [s].
            to_wall: Time on the machine's wall clock minus `now` [s].
            outcome: Receives the tasks of the shell.
        """
        try:
            session_token = self.room_admission.enter(peer, hello, now, to_wall)
            claim = Claim(hello.key, peer.source, peer.guest.session)
            self.waiting.check_name(hello.name, claim)
            try:
                joined = self.room.join(hello, now, peer.source, peer.guest)
            except ProtocolError as error:
                if error.code is not CloseCode.ROOM_FULL or not hello.wait:
                    raise
                self.waiting.enter(peer, session, hello, session_token, now, outcome)
                self.room_admission.begin(peer, now, to_wall)
                return
        except ProtocolError as error:
            session.fail(error)
            return
        self.room_admission.begin(peer, now, to_wall)
        self.waiting.take_in(hello.name, claim, outcome)
        self._seat(peer, session, hello, joined, to_wall, session_token, outcome)

    def come(
        self, peer: Peer, session: ServerSession, now: float, to_wall: float, outcome: Outcome
    ) -> None:
        """Make a client a user that has waited and was called to a seat, or end its session.

        The arguments are those of `join`.
        """
        hello = self.waiting.called(peer)
        if hello is None:
            session.fail(RemoteProtocolError("message", "Come", "nothing before it is called"))
            return
        try:
            token = self.room_admission.check(peer, hello.name, now, to_wall)
            joined = self.room.join(hello, now, peer.source, peer.guest, called=True)
        except ProtocolError as error:
            session.fail(error)
            return
        self._seat(peer, session, hello, joined, to_wall, token, outcome)

    def _seat(
        self,
        peer: Peer,
        session: ServerSession,
        hello: Hello,
        taken_in: tuple[Welcome, UserJoined, tuple[UserLeft, ...]],
        to_wall: float,
        token: str | None,
        outcome: Outcome,
    ) -> None:
        welcome, joined, replaced = taken_in
        for left in replaced:
            limit = "its only connection: it has come back with another"
            for other in self.peers:
                if other.user == left.user and isinstance(other.session, ServerSession):
                    other.session.fail(ProtocolError("user", left.name, limit), Event.REPLACED)
            tell_others(self.peers, peer, left, outcome)
        peer.user = welcome.user
        mesh = self.room.frames.touch_mesh() if hello.geometry == "mesh" else None
        changes = {"to_wall": to_wall, "session": token}
        session.accept(welcome.model_copy(update=changes), mesh)
        if self.room.record is not None:
            session.send(Recorded(on=True))
        sentence = f"{hello.name} joined with {hello.law.value}"
        outcome.say("joined", sentence, peer.source, user=hello.name)
        tell_others(self.peers, peer, joined, outcome)
        if self.room.members[welcome.user].muted:  # the user is new under this number
            tell_restraints(self.room, self.peers, outcome)
        elif self.room.restrains:
            tell_restraints(self.room, [peer], outcome)

    def watch(self, peer: Peer, watch: Watch, now: float, to_wall: float, outcome: Outcome) -> None:
        """Make a client a watcher, or end its session; the arguments are those of `join`."""
        watcher = Watcher(watch, has_model=self.scene_broadcast.model is not None)
        peer.session = watcher
        try:
            session_token = self.room_admission.enter(peer, watch, now, to_wall)
            self._check_pages(peer)
            self.scene_broadcast.enter(watcher, to_wall, peer.guest.grants, session_token)
            self.room_admission.begin(peer, now, to_wall)
            if self.room.restrains:
                watcher.send(self.room.restraints)
            if self.room.record is not None:
                watcher.send(Recorded(on=True))
            if administers(peer):
                tell_put_out(self.room_admission.removed, [peer], now, outcome)
        except ProtocolError as error:
            watcher.fail(error)
            return
        peer.needs_mesh = True

    def _check_pages(self, peer: Peer) -> None:
        """Raise RemoteProtocolError if `MAX_PAGES` pages of the peer's session watch already."""
        session = peer.guest.session
        pages = [one for one in self.peers if one.watches and one.session.hears_news]
        count = sum(one.guest.session == session for one in pages)
        if session and count >= MAX_PAGES:
            subject = "number of pages that watch with one invitation's session"
            limit = f"at most {MAX_PAGES}: ask for an invitation of your own"
            raise RemoteProtocolError(subject, count + 1, limit, CloseCode.ROOM_FULL, "watchers")


def tell_others(peers: Iterable[Peer], peer: Peer, news: ServerControl, outcome: Outcome) -> None:
    """Send news to all peers except `peer`."""
    for other in peers:
        if other is not peer and other.session.hears_news:
            other.session.send(news)
            outcome.flush.append(other)
