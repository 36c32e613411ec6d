"""The peers of a room, and the tasks for the shell that result from an event."""

from __future__ import annotations

from dataclasses import dataclass, field

from cohaptic.errors import one_line
from cohaptic.protocol.messages import Mark
from cohaptic.simulated.delay_line import AT_ONCE, LinkSettings
from cohaptic.status.row_batch import RowBatch
from cohaptic_server.access.admission import ANYBODY, Guest
from cohaptic_server.room.session import ServerSession
from cohaptic_server.room.watch.watcher import Watcher

_LONGEST_LINE = 400  # characters; enough for a name, a reason and the server's own words


@dataclass(eq=False)
class Peer:
    """The client at the other end of one connection.

    Attributes:
        session: Server's half of the protocol with the client; a `Watcher` replaces the first
            session if the client watches.
        user: User number in the room; None before the client has joined, and for a watcher.
        latency: Injected link, each way.
        network: Words with which a watcher asked for it.
        needs_mesh: Whether the mesh at rest must be sent next.
        source: Network address against whose rate limits the connection counts.
        guest: Identity and grants of the client, which the token in its first message determines.
        ends: Time at which the session expires [s], on the clock of this process, so that a change
            of the wall clock ends no session.
        farewell: Whether the client itself has closed the connection properly.
    """

    session: ServerSession | Watcher
    user: int | None = None
    latency: LinkSettings = AT_ONCE
    network: str = ""
    needs_mesh: bool = False
    source: str = ""
    guest: Guest = ANYBODY
    ends: float = float("inf")
    farewell: bool = False

    @property
    def watches(self) -> bool:
        """Whether the peer is a watcher."""
        return isinstance(self.session, Watcher)


@dataclass(frozen=True, slots=True)
class LogLine:
    """A line for the server's log.

    Args:
        text: Text of the line.
        warning: Whether the line reports a problem.
        source: Network address that the line is about; lines above the rate limit of an address are
            omitted.
        event: Machine-readable name of the event.
        user: Name of the user whom the event concerns; empty if there is no name.
        field: Field at fault of a refusal (`ProtocolError.field`); empty otherwise.
        code: Close code of a refusal; 0 otherwise.
    """

    text: str
    warning: bool = False
    source: str = ""
    event: str = ""
    user: str = ""
    field: str = ""
    code: int = 0


@dataclass(slots=True)
class Outcome:
    """Tasks that the shell must carry out after an event.

    Attributes:
        flush: Peers whose sessions have something to write or to close, in order.
        delayed: Peers whose injected latency has changed.
        log: Lines for the log.
        marks: Marks for a recording, each with the number of the user who has set it; None for one
            who watches.
        rows: Rows of users' loops for a recording, with the number of the user.
        recordings: Administrators who ask that the session be recorded from now on, or no longer.
    """

    flush: list[Peer] = field(default_factory=list[Peer])
    delayed: list[Peer] = field(default_factory=list[Peer])
    log: list[LogLine] = field(default_factory=list[LogLine])
    marks: list[tuple[Mark, int | None]] = field(default_factory=list[tuple[Mark, int | None]])
    rows: list[tuple[RowBatch, int]] = field(default_factory=list[tuple[RowBatch, int]])
    recordings: list[tuple[Peer, bool]] = field(default_factory=list[tuple[Peer, bool]])

    def say(
        self,
        event: str,
        text: str,
        source: str = "",
        *,
        user: str = "",
        refusal: tuple[str, int] = ("", 0),
        warning: bool = False,
    ) -> None:
        """Add one line to the log; unprintable characters, which strangers may send, become "?".

        Args:
            refusal: Field at fault and close code of somebody who was refused.
        """
        line = one_line(text, _LONGEST_LINE)
        user, field = one_line(user, _LONGEST_LINE), one_line(refusal[0], _LONGEST_LINE)
        self.log.append(LogLine(line, warning, source, event, user, field, refusal[1]))


NOTHING = Outcome()  # outcome of a sample: nothing is added to it, and the shell skips it
