"""Who may come in and how much they may ask for, at this server: the budgets with their clock.

It counts what came, went and was turned away since the start of the server.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from cohaptic.clock import Clock
from cohaptic.errors import CloseCode
from cohaptic_server.guard.limits import Limits
from cohaptic_server.guard.log_lines import LogLines
from cohaptic_server.guard.meter import Meter
from cohaptic_server.guard.proxies import Proxies
from cohaptic_server.guard.sources import UNKNOWN, Refusal, Sources
from cohaptic_server.room.peer import LogLine

_CAUSES = {code.value: code.name.lower() for code in CloseCode}
# Of the library and ours; neither tells of a refusal.
_PEACEFUL = (1000, 1001, CloseCode.SERVER_STOPS.value, CloseCode.OBJECT_CHANGED.value)


@dataclass(slots=True)
class Traffic:
    """Counters of one process. Their keys are this program's words, never a peer's.

    Attributes:
        received: Bytes of all connections, after TLS.
        sent: Bytes of messages and of the bodies of responses, before TLS.
        refused: Sessions that the server has closed, and requests that it has not served, by cause.
        spent: Connections that were closed because a budget was spent, by budget.
    """

    received: int = 0
    sent: int = 0
    refused: Counter[str] = field(default_factory=Counter[str])
    spent: Counter[str] = field(default_factory=Counter[str])

    def end(self, close: tuple[int, str] | None) -> None:
        """Count the end of a session, if the server has closed it for a reason.

        Args:
            close: Code and reason; None if the peer has gone by itself.
        """
        if close is not None and close[0] not in _PEACEFUL:
            self.refused[_CAUSES.get(close[0], "other")] += 1


log = logging.getLogger("cohaptic.server")

_MOST_FILES = 10**6
_OWN_FILES = 40  # a server has 20 or so, and an upload and a process that starts some more
_HANDSHAKES_AT_ONCE = 4  # 3 ms
_REPORTED_AFTER = 10.0  # s since the first line that was left out


class Gate:
    """Gate of one server.

    Args:
        limits: All budgets.
        clock: Clock of the server.
        simulation_hz: Its ticks per second.
        proxies: Addresses and networks whose word on where a connection comes from is believed.

    Attributes:
        limits: The same, with no more connections than the system has files for.
        clock: The same.
        sources: Sources of all addresses.
        proxies: The same.
        taken: Connections that are open, by the number of their file.
        came: Set when one is added to them.
        traffic: What came, went and was turned away.
    """

    def __init__(
        self,
        limits: Limits,
        clock: Clock,
        simulation_hz: float = 60.0,
        proxies: Sequence[str] = (),
    ) -> None:
        self.limits = limits = replace(limits, open_in_all=min(limits.open_in_all, _files()))
        self.clock = clock
        self.sources = Sources(limits)
        self.proxies = Proxies.named(proxies)
        self.taken: dict[int, Taken] = {}
        self.came = asyncio.Event()
        self.traffic = Traffic()
        self._lines = LogLines(limits.lines)
        self._next_report = 0.0
        self._simulation_hz = simulation_hz

    def source_of_peer(self, peername: Any) -> str:
        """Whom a connection is counted with, from what its transport calls the other end."""
        # Of a socket of the internet a tuple that begins with the address, and text of any other.
        if not peername or isinstance(peername, str):
            return UNKNOWN
        return self.proxies.source_of(str(peername[0]))

    def meter(self) -> Meter:
        """Meter of a new connection."""
        return Meter(self.limits, self._simulation_hz)

    def tell(self, source: str, event: str, text: str, *, warning: bool = False) -> None:
        """Write a line about an address to the log, unless there are too many about it."""
        self.write(LogLine(text, warning, source, event))

    def write(self, line: LogLine) -> None:
        """The same, of a line that is made."""
        if self._lines.pass_on(line.source, self.clock.now()):
            level = logging.WARNING if line.warning else logging.INFO
            told = {"event": line.event, "user": line.user, "source": line.source}
            log.log(level, "%s", line.text, extra=told)

    def admit(self, source: str) -> Refusal | None:
        """Count a connection; `Sources.leave` has to follow when it has ended.

        Args:
            source: Address of the peer; that of a proxy is settled when it says whom it brings.

        Returns:
            Why it is not taken.
        """
        now, sources = self.clock.now(), self.sources
        by_proxy = source in self.proxies
        return sources.enter_proxy(source, now) if by_proxy else sources.enter(source, now)

    def keep(self, connection: Taken, source: str) -> None:
        """A connection that was admitted counts until it is closed."""
        connection.gate, connection.source = self, source
        self.taken[connection.fileno()] = connection
        self.came.set()

    def enter(self, connection: Taken, source: str) -> Refusal | None:
        """Both; arguments as for them. Returns why it is not taken."""
        refusal = self.admit(source)
        if refusal is None:
            self.keep(connection, source)
        return refusal

    def settle(
        self, file: int, proxy: str, said: Sequence[Sequence[str]], now: float
    ) -> str | Refusal:
        """Count a connection of a proxy with whom the proxy says it comes from.

        Args:
            file: Number of the connection's file.
            proxy: Its source.
            said: Values of X-Forwarded-For and those of Forwarded, in their order.
            now: Time [s].

        Returns:
            Whom it is counted with, or why it is not taken.
        """
        source = self.proxies.visitor(proxy, *said)
        if isinstance(source, Refusal):
            self.tell(proxy, "refused", f"a connection of {proxy} was refused: {source.why}")
            return source
        connection = self.taken.get(file)
        if connection is None or connection.source == source:
            return source
        refusal = self.sources.enter(source, now)
        if refusal is not None:
            return refusal
        self.sources.leave(connection.source)
        connection.source = source
        return source

    def report(self, after: float = _REPORTED_AFTER) -> None:
        """Tell how many lines were left out; called at every tick, and does nothing in most."""
        now = self.clock.now()
        if after and now < self._next_report:
            return
        self._next_report = now + 1.0
        for source, count in self._lines.left_out(now, after):
            told = {"event": "lines_left_out", "source": source}
            log.warning("%d lines about %s were left out", count, source, extra=told)


class Turns:
    """So many handshakes may go on before other events have their turn, and ticks among them.

    A handshake takes 0.75 ms, and all that are ready at once would be served at once: 256 of one
    address in 0.2 s. What is not read now is ready again in the next round.

    Args:
        soon: Calls back once other events have had their turn.
    """

    def __init__(self, soon: Callable[[Callable[[], None]], object]) -> None:
        self._soon = soon
        self._taken = 0

    def take(self) -> bool:
        """Whether one more may go on."""
        if self._taken == 0:
            self._soon(self._go_on)
        self._taken += 1
        return self._taken <= _HANDSHAKES_AT_ONCE

    def _go_on(self) -> None:
        self._taken = 0


class Taken(socket.socket):
    """A connection that is counted until its file is closed, whatever became of it.

    One whose TLS handshake fails never has a protocol that could say that it has ended.

    Attributes:
        gate: That it is counted at; None once it is not any more.
        source: Whom it is counted with.
        turns: Turns that handshakes take, during its own; None before and after, and without TLS.
    """

    gate: Gate | None = None
    source = UNKNOWN
    turns: Turns | None = None

    def recv_into(self, buffer: Any, nbytes: int = 0, flags: int = 0) -> int:
        """As in the library, which reads TLS so; a handshake waits until it is its turn."""
        if self.turns is not None and not self.turns.take():
            raise BlockingIOError
        return super().recv_into(buffer, nbytes, flags)

    def keep_counted(self) -> None:
        """Its end is no end of the count: it goes on elsewhere, and whoever sent it there knows."""
        gate, self.gate = self.gate, None
        if gate is not None:
            gate.taken.pop(self.fileno(), None)

    def close(self) -> None:
        """End the connection."""
        gate = self.gate
        self.keep_counted()
        if gate is not None:
            gate.sources.leave(self.source)
        super().close()


def _files() -> int:
    """Connections that the system gives files for, beside those that the server needs itself."""
    if sys.platform == "win32":
        return _MOST_FILES
    import resource

    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return max(8, (_MOST_FILES if soft == resource.RLIM_INFINITY else soft) - _OWN_FILES)
