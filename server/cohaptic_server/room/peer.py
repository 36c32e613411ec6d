"""The peers of a room, and the tasks that an event at one of them leaves to the shell."""

from __future__ import annotations

from dataclasses import dataclass, field

from cohaptic.errors import one_line
from cohaptic_server.access.admission import ANYBODY, Guest
from cohaptic_server.room.session import ServerSession
from cohaptic_server.room.watch.watcher import Watcher

_LONGEST_LINE = 400  # characters; a name, a reason and our own words


@dataclass(eq=False)
class Peer:
    """The client at the other end of one connection.

    Attributes:
        session: Its half of the protocol; a watcher replaces the session that it began as.
        user: Number in the room; None before it has joined, and for a watcher.
        latency: Injected delay and jitter, each way [s].
        needs_mesh: Whether the resting mesh must be sent next.
        source: Whom its connection is counted with.
        guest: Who it is, once its first message has said so.
        ends: When its session is over [s]. On the clock of this process, so that a wall clock that
            is set ends nobody's.
        farewell: Whether it has closed the connection itself, in order.
    """

    session: ServerSession | Watcher
    user: int | None = None
    latency: tuple[float, float] = (0.0, 0.0)
    needs_mesh: bool = False
    source: str = ""
    guest: Guest = ANYBODY
    ends: float = float("inf")
    farewell: bool = False

    @property
    def watches(self) -> bool:
        """Whether it is a watcher."""
        return isinstance(self.session, Watcher)


@dataclass(frozen=True, slots=True)
class LogLine:
    """A line for the server's log.

    Args:
        text: Text of the line.
        warning: Whether it tells of a problem.
        source: Whom it is about; too many lines about one are left out.
        event: What has happened, in a word for machines.
        user: Name of who it happened to; empty for who has none.
    """

    text: str
    warning: bool = False
    source: str = ""
    event: str = ""
    user: str = ""


@dataclass(slots=True)
class Outcome:
    """Tasks of the shell after an event.

    Attributes:
        flush: Peers whose sessions have something to write or to close, in order.
        delayed: Peers whose injected latency has changed.
        log: Lines for the log.
    """

    flush: list[Peer] = field(default_factory=list[Peer])
    delayed: list[Peer] = field(default_factory=list[Peer])
    log: list[LogLine] = field(default_factory=list[LogLine])

    def say(
        self, event: str, text: str, source: str = "", *, user: str = "", warning: bool = False
    ) -> None:
        """Add a line to the log, as one printable line: it may quote strangers."""
        line = one_line(text, _LONGEST_LINE)
        self.log.append(LogLine(line, warning, source, event, one_line(user, _LONGEST_LINE)))


NOTHING = Outcome()  # of a sample: nobody adds to it, and the shell passes over it
