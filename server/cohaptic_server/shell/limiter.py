"""Access settings of a server, and the limiter, which admits connections within rate limits.

The settings are those of access control and encryption, and the proxies that the server trusts.

The limiter also counts bytes, refusals and exceeded rate limits since the start of the server.
"""

from __future__ import annotations

import asyncio
import logging
import math
import socket
import ssl
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from cohaptic.clock import Clock
from cohaptic.errors import CloseCode
from cohaptic_server.access.admission import Admission
from cohaptic_server.credentials.certificate import Certificate
from cohaptic_server.credentials.reloading import Watched
from cohaptic_server.guard.limits import Limits
from cohaptic_server.guard.proxies import Proxies
from cohaptic_server.guard.sources import UNKNOWN, LogLines, Meter, Refusal, Sources
from cohaptic_server.room.peer import LogLine


@dataclass(frozen=True, slots=True)
class Protection:
    """Access control and encryption of one server; by default, anybody may come in, unencrypted.

    Args:
        admission: Decides which clients may come in.
        certificate: Certificate for TLS; None without TLS.
        proxies: Addresses and networks of trusted proxies, whose headers name a connection's
            origin.
        watched: Files that the server reads again when they change.
        state: Folder for bans and used tokens, which outlive the process; None stores nothing.
    """

    admission: Admission = field(default_factory=Admission)
    certificate: Certificate | None = None
    proxies: Sequence[str] = ()
    watched: Sequence[Watched] = ()
    state: Path | None = None

    @property
    def tls(self) -> ssl.SSLContext | None:
        """TLS settings of every connection; None without TLS."""
        return None if self.certificate is None else self.certificate.context


_CAUSES = {code.value: code.name.lower() for code in CloseCode}
# Codes of a normal end, from RFC 6455 and from this server; none is a refusal.
_PEACEFUL = (1000, 1001, CloseCode.SERVER_STOPS.value, CloseCode.OBJECT_CHANGED.value)


@dataclass(slots=True)
class Traffic:
    """Counters of one process; their keys are words of this program, never text from a peer.

    Attributes:
        received: Bytes from all connections, after TLS decryption.
        sent: Bytes of messages and of the bodies of responses, before TLS encryption.
        refused: Number of sessions that the server has closed, and of requests that it has not
            served, by cause.
        spent: Number of connections or responses that were refused because of an exceeded rate
            limit, by name of the limit.
    """

    received: int = 0
    sent: int = 0
    refused: Counter[str] = field(default_factory=Counter[str])
    spent: Counter[str] = field(default_factory=Counter[str])

    def end(self, close: tuple[int, str] | None) -> None:
        """Count the end of a session as a refusal, if the server has closed it for a fault.

        Args:
            close: Code and reason with which the server closed; None if the peer left by itself.
        """
        if close is not None and close[0] not in _PEACEFUL:
            self.refused[_CAUSES.get(close[0], "other")] += 1


log = logging.getLogger("cohaptic.server")

_MAX_FILES = 10**6
_OWN_FILES = 40  # a server has about 20 open; an upload or a starting process needs some more
_HANDSHAKES_AT_ONCE = 4  # TLS handshakes; 3 ms
# Without a tick for so long the process counts as having stood still, if it has computed for less
# than this share of the time: a process that floods keep busy computes for all of it. A tick comes
# every 0.1 s at least, and a sleeping server looks up every second (`NAP`).
_STOOD_STILL = 2.0  # s
_COMPUTED = 0.5
_PARDONS_APART = 60.0  # s; a machine that is short of processors for long is not one that slept
_REPORTED_AFTER = 10.0  # s from the first suppressed line until their number is reported


class ConnectionLimiter:
    """Admits the connections of one server, counts them, and limits the log lines about them.

    Args:
        limits: Rate limits and other limits of connections and addresses.
        simulation_hz: Ticks of the server per second.
        proxies: Addresses and networks of trusted proxies, whose headers name a connection's
            origin.

    Attributes:
        limits: The limits, with `open_in_all` reduced to the number of available file descriptors.
        sources: State of the rate limits of all addresses.
        taken: Open connections that count against the limits, by file descriptor.
        came: Event that is set when a connection is added to `taken`; wakes a sleeping server.
        traffic: Counters of bytes, refusals and exceeded rate limits.
    """

    _ticked = math.inf  # no tick is expected yet
    _computed = 0.0  # processor time of this thread at that tick [s]
    _resumed = -math.inf
    _pardons = 0

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
        """Return the source of a connection, found from the peer name of its transport."""
        # An IP socket has a tuple that begins with the address; other sockets have a text.
        if not peername or isinstance(peername, str):
            return UNKNOWN
        return self.proxies.source_of(str(peername[0]))

    def meter(self) -> Meter:
        """Return a meter that checks the rates of a new connection's messages."""
        return Meter(self.limits, self._simulation_hz)

    def tick(self, now: float, computed: float) -> None:
        """Note that a tick begins.

        Args:
            now: Present time [s].
            computed: Processor time that this thread has taken [s].
        """
        if now - self._ticked > _STOOD_STILL:
            self._look(now, computed)
        self._ticked, self._computed = now, computed

    def pause(self) -> None:
        """Expect no tick until the next one."""
        self._ticked = math.inf

    def pardon(self, now: float, computed: float) -> int:
        """Return the number of the pardon for what piled up while this process stood still, or 0.

        The process, or its machine, may have been suspended. Nobody is to be accused of a flood
        then; but a connection has each pardon once, so that no flood can hide behind it.

        Args:
            now: Present time [s].
            computed: Processor time that this thread has taken [s].
        """
        self._look(now, computed)
        return self._pardons if now - self._resumed < _STOOD_STILL else 0

    def _look(self, now: float, computed: float) -> None:
        """Begin a pardon if this process has stood still since the last tick."""
        still = now - self._ticked
        if still > _STOOD_STILL and now - self._resumed > _PARDONS_APART:
            if computed - self._computed < _COMPUTED * still:
                self._resumed = now
                self._pardons += 1

    def tell(self, source: str, event: str, text: str, *, warning: bool = False) -> None:
        """Write a log line about an address, unless the address's limit for lines is reached."""
        self.write(LogLine(text, warning, source, event))

    def write(self, line: LogLine) -> None:
        """Write a log line, unless the rate limit of its source is reached."""
        if self._lines.pass_on(line.source, self.clock.now()):
            level = logging.WARNING if line.warning else logging.INFO
            extra = {
                "event": line.event, "user": line.user, "source": line.source,
                "field": line.field, "code": line.code,
            }  # fmt: skip
            log.log(level, "%s", line.text, extra=extra)

    def admit(self, source: str) -> Refusal | None:
        """Count a new connection if the limits allow it.

        The caller must call `Sources.leave` when the connection has ended.

        Args:
            source: Source of the peer; a proxy's connection gets its final source in `settle`.

        Returns:
            The refusal; None if the connection is admitted.
        """
        now, sources = self.clock.now(), self.sources
        by_proxy = source in self.proxies
        return sources.enter_proxy(source, now) if by_proxy else sources.enter(source, now)

    def keep(self, connection: Taken, source: str) -> None:
        """Count an admitted connection against its source until its socket is closed."""
        connection.limiter, connection.source = self, source
        self.taken[connection.fileno()] = connection
        self.came.set()

    def enter(self, connection: Taken, source: str) -> Refusal | None:
        """Admit a connection and count it until its socket is closed; return None or a refusal."""
        refusal = self.admit(source)
        if refusal is None:
            self.keep(connection, source)
        return refusal

    def settle(
        self, file: int, proxy: str, said: Sequence[Sequence[str]], now: float
    ) -> str | Refusal:
        """Count a connection that a proxy forwards against the visitor's address, not the proxy's.

        Args:
            file: File descriptor of the connection.
            proxy: Source of the proxy.
            said: Values of the headers X-Forwarded-For and of the headers Forwarded, in order.
            now: Time [s].

        Returns:
            Source against whose rate limits the connection counts from now on, or the refusal.
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
        """Log the number of suppressed lines, at most once a second; called at every tick.

        Args:
            after: Least time since the first suppressed line about a source [s]; 0 reports at once.
        """
        now = self.clock.now()
        if after and now < self._next_report:
            return
        self._next_report = now + 1.0
        for source, count in self._lines.left_out(now, after):
            reported = {"event": "lines_left_out", "source": source}
            log.warning("%d lines about %s were left out", count, source, extra=reported)


class Turns:
    """Limits the TLS handshakes in one round of the event loop, so that ticks are not delayed.

    A handshake takes 0.75 ms, and the loop would serve all ready handshakes in one round: 256 from
    one address take 0.2 s. Bytes that are not read now are ready again in the next round.

    Args:
        soon: Schedules a call for the next round of the event loop.
    """

    def __init__(self, soon: Callable[[Callable[[], None]], object]) -> None:
        self._soon = soon
        self._taken = 0

    def take(self) -> bool:
        """Count one handshake, and return whether it may proceed in this round."""
        if self._taken == 0:
            self._soon(self._go_on)
        self._taken += 1
        return self._taken <= _HANDSHAKES_AT_ONCE

    def _go_on(self) -> None:
        self._taken = 0


class Taken(socket.socket):
    """Socket of a connection that the limiter counts until the socket is closed.

    The socket itself reports its end to the limiter, since a connection whose TLS handshake fails
    never has a protocol that could report it.

    Attributes:
        limiter: Limiter that counts the connection; None after the counting has ended.
        source: Source against whose rate limits the connection counts.
        turns: Limit on handshakes per round, while this connection's handshake runs; None after it
            and without TLS.
    """

    limiter: ConnectionLimiter | None = None
    source = UNKNOWN
    turns: Turns | None = None

    def recv_into(self, buffer: Any, nbytes: int = 0, flags: int = 0) -> int:
        """Receive as the standard socket does; during a handshake only if `turns` allows it."""
        if self.turns is not None and not self.turns.take():
            raise BlockingIOError
        return super().recv_into(buffer, nbytes, flags)

    def keep_counted(self) -> None:
        """Let the limiter count the connection beyond the close of this socket.

        This is for a connection that another process takes over; the code that hands it over calls
        `Sources.leave` when the other process has ended the connection.
        """
        limiter, self.limiter = self.limiter, None
        if limiter is not None:
            limiter.taken.pop(self.fileno(), None)

    def close(self) -> None:
        """Close the socket, and count the connection's end if the limiter still counts it."""
        limiter = self.limiter
        self.keep_counted()
        if limiter is not None:
            limiter.sources.leave(self.source)
        super().close()


def _files() -> int:
    """Return how many connections the limit on open files allows beside the server's own files."""
    if sys.platform == "win32":
        return _MAX_FILES
    import resource

    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return max(8, (_MAX_FILES if soft == resource.RLIM_INFINITY else soft) - _OWN_FILES)
