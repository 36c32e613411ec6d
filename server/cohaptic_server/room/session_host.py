"""Joining, watching, control laws and injected latency of one room, as a state machine without I/O.

The shell reports connections, messages and the time, and carries out the `Outcome` of each. The
messages to a peer, and the closing of its connection, wait in the peer's session.
"""

from __future__ import annotations

from cohaptic.errors import CloseCode, ProtocolError, RemoteProtocolError
from cohaptic.protocol.control.message import SetName
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.messages import Come, Hello, Mark, Recorded, SetLaw, wrong_version
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.protocol.watch_messages import (
    Moderate,
    Moderated,
    ModerationName,
    SetLatency,
    SetView,
    Watch,
    WatchRequest,
)
from cohaptic_server.access.admission import session_over
from cohaptic_server.access.keys import forbidden
from cohaptic_server.room.company.shared_views import SharedViews
from cohaptic_server.room.latency import Data, latencies, set_latency
from cohaptic_server.room.latency import refusal as refusal_of_latency
from cohaptic_server.room.life import State
from cohaptic_server.room.moderation import end_freeze, moderate
from cohaptic_server.room.peer import NOTHING, Outcome, Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.seats.renaming import rename
from cohaptic_server.room.session import ServerSession
from cohaptic_server.room.session_setup import RoomAdmission, SessionSetup, tell_others
from cohaptic_server.room.watch.scene_broadcast import SceneBroadcast
from cohaptic_server.room.watch.watcher import Watcher

_ROWS = bytes((FrameKind.ROWS,))
MESH_TIMEOUT = 30.0  # s for a watcher to take the resting mesh


class SessionHost:
    """State machine of all connections to one room.

    Args:
        room: Room with the users.
        scene_broadcast: Watchers of the room.
        room_admission: RoomAdmission that checks tokens and grants; None if everybody may come in.

    Attributes:
        peers: Peers in the order in which they connected.
        session_setup: SessionSetup that lets the peers into the room.
        shared_views: People in the room: who is there, whose view others follow, and who points.
    """

    def __init__(
        self,
        room: Room,
        scene_broadcast: SceneBroadcast,
        room_admission: RoomAdmission | None = None,
    ) -> None:
        self.room = room
        self.room_admission = RoomAdmission() if room_admission is None else room_admission
        self.scene_broadcast = scene_broadcast
        self.peers: list[Peer] = []
        self.session_setup = SessionSetup(room, scene_broadcast, self.room_admission, self.peers)
        self.shared_views = SharedViews(room, scene_broadcast.watchers, self.room_admission.sources)
        self._ticked = 0.0
        self._scene_problem: str | None = None

    def connect(
        self, now: float, subprotocol: str | None, offered: str | None, source: str = ""
    ) -> Peer:
        """Add a new connection, and return its peer.

        Args:
            now: Time [s].
            subprotocol: Subprotocol chosen for the websocket; None without one.
            offered: All subprotocols that the client offered; None if it offered none.
            source: Network address against whose rate limits the connection counts.
        """
        session = ServerSession(now)
        if subprotocol != SUBPROTOCOL:
            session.fail(wrong_version(offered or "not named as a subprotocol"))
        peer = Peer(session, source=source)
        self.peers.append(peer)
        return peer

    def receive(self, peer: Peer, data: Data, now: float, to_wall: float) -> Outcome:
        """Handle one message from a peer, and return the tasks that result for the shell.

        Args:
            peer: Sender of the message.
            now: Time [s].
            to_wall: Time on the machine's wall clock minus `now` [s].
        """
        session = peer.session
        if peer.user is not None and isinstance(data, bytes) and not isinstance(session, Watcher):
            if data[1:2] == _ROWS:
                return self._receive_rows(peer, session, data, peer.user)
            sample = session.receive_sample(data)
            if sample is None:
                return Outcome([peer])
            self.room.sample(peer.user, sample, now)
            return NOTHING
        outcome = Outcome()
        session.receive(data, now)
        if isinstance(session, Watcher):
            for request in session.events():
                self._carry_out(peer, session, request, now, to_wall, outcome)
            outcome.flush.append(peer)
            return outcome
        self._handle_events(peer, session, now, to_wall, outcome)
        outcome.flush.append(peer)
        return outcome

    def _receive_rows(self, peer: Peer, session: ServerSession, data: bytes, user: int) -> Outcome:
        if self.room.record is None:
            return NOTHING  # the recording has just ended
        rows = session.receive_rows(data)
        if rows is None:
            return Outcome([peer])
        return Outcome(rows=[(rows, user)])

    def tick(self, now: float) -> None:
        """Advance the simulation by one period."""
        self._ticked = now
        self.room.tick(now)

    @property
    def sleeps(self) -> bool:
        """Whether the room can skip ticks unnoticed: no peer is connected, the body is at rest."""
        return not self.peers and self.room.at_rest

    def pass_over(self, ticks: int, now: float) -> None:
        """Count `ticks` ticks that passed while the room slept, the last one at time `now` [s]."""
        self._ticked = now
        self.room.pass_over(ticks, now)

    def serve(self, now: float) -> Outcome:
        """Queue each user's newest patch, and end the sessions whose deadline has passed.

        The method also calls waiting clients to free seats, and ends a freeze that has lasted too
        long.
        """
        outcome = Outcome()
        self.session_setup.waiting.step(now, outcome)
        if self.room.frozen:
            end_freeze(self.room, self.peers, now, outcome)
        patches = self.room.patches
        for peer in self.peers:
            session = peer.session
            if now >= peer.ends and session.close is None:
                session.fail(session_over())
                outcome.flush.append(peer)
            if isinstance(session, Watcher):
                continue
            patch = None if peer.user is None else patches.get(peer.user)
            if patch is not None:
                self._serve_patch(peer, session, patch, outcome)
            session.handle_timer(now)
            if session.close is not None or not session.outbox.empty:
                outcome.flush.append(peer)
        return outcome

    @property
    def watching(self) -> list[Peer]:
        """Peers that are watchers."""
        return [peer for peer in self.peers if peer.watches]

    def update_scene(self) -> None:
        """Make the newest tick the scene for all watchers, and tell them who is in the room."""
        self.scene_broadcast.see(self.room.world, self.room.patches, self._ticked)
        self.shared_views.step(self._ticked)

    def show(self, peer: Peer, now: float, *, clear: bool) -> Outcome:
        """Queue the newest scene for a watcher, if the watcher is due to get one.

        Args:
            peer: Peer that is a watcher.
            now: Time [s].
            clear: Whether the operating system has taken all earlier writes to the peer.
        """
        outcome = Outcome([peer])
        watcher = peer.session
        assert isinstance(watcher, Watcher)
        was_slow = watcher.slow
        self.scene_broadcast.show(watcher, now, clear=clear)
        if watcher.slow and not was_slow:
            words = "one who watches is slow: its scenes are not acknowledged"
            outcome.say("watcher_slow", words, peer.source)
        return outcome

    def report_scene(self) -> Outcome:
        """Log why the scene cannot be shown to watchers, unless the last call had that reason."""
        outcome = Outcome()
        problem = self.scene_broadcast.problem
        if problem is not None and problem != self._scene_problem:
            sentence = f"the scene cannot be shown: {problem}"
            outcome.say("no_scene", sentence, warning=True)
        self._scene_problem = problem
        return outcome

    def begin_mesh(self, peer: Peer) -> bytes:
        """Return the frame of the mesh for a new watcher; queue the users' latencies behind it."""
        peer.needs_mesh = False
        assert isinstance(peer.session, Watcher)
        for latency in latencies(self.peers):
            peer.session.tell_latency(latency)
        frames = self.room.frames
        return frames.shown_mesh() if peer.session.mesh == "quantised" else frames.rest_mesh()

    def finish_mesh(self, peer: Peer, now: float, *, taken: bool, clear: bool) -> Outcome:
        """Show the scene to a watcher that has the mesh; end its session if it took too long.

        Args:
            peer: Peer that is a watcher.
            now: Time [s].
            taken: Whether the peer took the whole mesh within `MESH_TIMEOUT`.
            clear: Whether the operating system has taken all earlier writes to the peer.
        """
        if not taken:
            limit = f"all of it taken within {MESH_TIMEOUT:g} s"
            error = RemoteProtocolError("rest mesh", "not taken", limit, CloseCode.TOO_SLOW)
            peer.session.fail(error)
        self.update_scene()
        return self.show(peer, now, clear=clear)

    def disconnect(self, peer: Peer, reason: str) -> Outcome:
        """Remove a connection that has ended, and tell the other peers if it was a user's.

        Args:
            peer: Peer whose connection has ended.
            reason: Reason that the peer gave for closing, or its error; empty without a reason.
        """
        outcome = Outcome()
        self.peers.remove(peer)
        peer.session.disconnect(reason, farewell=peer.farewell)
        close = peer.session.close
        lost = peer.session.state is State.KEPT
        reason = reason or (close[1] if close else "connection lost")
        field = peer.session.field
        refusal = (field, close[0]) if field and close else ("", 0)
        if isinstance(peer.session, Watcher):
            self.scene_broadcast.leave(peer.session)
            words = f"one who watches left: {reason}"
            outcome.say("watcher_left", words, peer.source, refusal=refusal)
        elif (name := self.session_setup.waiting.leave(peer, self._ticked)) is not None:
            sentence = f"{name} waits no more: {reason}"
            outcome.say("waits_no_more", sentence, peer.source, user=name, refusal=refusal)
        elif peer.user is None:
            words = f"a client was refused: {reason}"
            outcome.say("refused", words, peer.source, refusal=refusal)
        else:
            left = self.room.leave(
                peer.user, self._ticked, reason, lost=lost, seat=not peer.farewell
            )
            if left is not None:
                sentence = f"{left.name} left: {reason}"
                outcome.say("left", sentence, peer.source, user=left.name, refusal=refusal)
                tell_others(self.peers, peer, left, outcome)
        return outcome

    def tell_recorded(self, *, on: bool) -> Outcome:
        """Tell all peers whether the session is recorded from now on."""
        outcome = Outcome()
        for peer in self.peers:
            if peer.session.hears_news:
                peer.session.send(Recorded(on=on))
                outcome.flush.append(peer)
        return outcome

    def answer_recording(self, admin: Peer, *, begins: bool, done: bool) -> Outcome:
        """Tell an administrator whether a recording has begun, or ended, as asked."""
        outcome = Outcome()
        if admin in self.peers and admin.session.hears_news:
            action: ModerationName = "record" if begins else "end_recording"
            admin.session.send(Moderated(action=action, user=None, done=done))
            outcome.flush.append(admin)
        return outcome

    def stop(
        self, code: CloseCode = CloseCode.SERVER_STOPS, reason: str = "the server stops"
    ) -> Outcome:
        """End the sessions of all peers, and return the tasks for the shell."""
        for peer in self.peers:
            peer.session.stop(code, reason)
        return Outcome(list(self.peers))

    def _serve_patch(
        self, peer: Peer, session: ServerSession, patch: Patch, outcome: Outcome
    ) -> None:
        previous_problem = session.problem
        session.send_patch(patch)
        if session.problem and not previous_problem and peer.user is not None:
            name = self.room.members[peer.user].hello.name
            sentence = f"{name} gets no patch: {session.problem}"
            outcome.say("no_patch", sentence, peer.source, user=name, warning=True)

    def _handle_events(
        self, peer: Peer, session: ServerSession, now: float, to_wall: float, outcome: Outcome
    ) -> None:
        for event in session.events():
            match event:
                case Hello():
                    self.session_setup.join(peer, session, event, now, to_wall, outcome)
                case Come():
                    self.session_setup.come(peer, session, now, to_wall, outcome)
                case Watch():
                    self.session_setup.watch(peer, event, now, to_wall, outcome)
                case SetName():
                    self._rename(peer, event, now, outcome)
                case SetLaw() if peer.user is not None:
                    self._set_law(peer, peer.user, event, now)
                case Mark():
                    outcome.marks.append((event, peer.user))
                case _:
                    pass

    def _carry_out(
        self,
        peer: Peer,
        session: Watcher,
        request: WatchRequest,
        now: float,
        to_wall: float,
        outcome: Outcome,
    ) -> None:
        match request:
            case Moderate():
                who = (self.room, self.peers, self.room_admission.removed, peer)
                moderate(*who, request, now, to_wall, outcome)
            case SetLatency():
                error = refusal_of_latency(peer, allowed=self.room.settings.allow_latency)
                try:
                    if error is None:
                        set_latency(self.peers, self.scene_broadcast.watchers, request, outcome)
                except ProtocolError as wrong:
                    error = wrong
                if error is not None:
                    session.fail(error)
            case Mark():
                if peer.guest.grants.can_touch or peer.guest.grants.room_admin:
                    outcome.marks.append((request, None))
                else:
                    session.fail(forbidden("the token does not let you set marks (canTouch)"))
            case SetView():
                pass  # the session has handled this message
            case _:
                self.shared_views.hear(session, request, peer.source, now)

    def _rename(self, peer: Peer, wish: SetName, now: float, outcome: Outcome) -> None:
        room, waiting = self.room, self.session_setup.waiting
        try:
            rename(room, waiting, self.room_admission, self.peers, peer, wish, now, outcome)
        except ProtocolError as error:
            peer.session.fail(error)

    def _set_law(self, peer: Peer, user: int, change: SetLaw, now: float) -> None:
        try:
            self.room.set_law(user, change, now)
        except ProtocolError as error:
            peer.session.fail(error)
