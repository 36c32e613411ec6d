"""A listening socket that passes a connection on only after the client has sent a request.

asyncio makes a transport, a protocol, a task and timers for each connection, which take 0.3 ms and
14 kB. A connection that is still silent needs none of them: here it waits in the backlog, as a
plain socket in one epoll set. A connection beyond a rate limit is refused. The reason is sent as an
HTTP response, since every client speaks HTTP first.

Epoll reports the connections that have sent bytes, and takes no time for the others. The backlog
peeks at the bytes and leaves them to the handler that serves the connection. Since the bytes stay
in the socket, epoll is edge-triggered: it reports only new bytes.

A connection is passed on to asyncio after it has sent the head of a request, or a TLS hello.
Connections that send anything else are passed on too: the code that reads the bytes judges them.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import select
import socket
import sys
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any

from cohaptic.protocol.websocket_frames import END_OF_HEAD
from cohaptic_server.guard.sources import Refusal
from cohaptic_server.shell.limiter import ConnectionLimiter, Taken, Turns
from cohaptic_server.shell.refusal import turn_away
from cohaptic_server.shell.wire import HEAD_TIMEOUT

LARGEST = 4096  # bytes that are looked at; a longer head, or TLS hello, is passed on before its end
_HANDSHAKE = b"\x16"  # type of a TLS record; two bytes of version and two of length follow
_RECORD_HEAD = 5


def has_asked(seen: bytes, *, tls: bool) -> bool:
    """Whether a client has sent its whole request, or bytes that cannot become one.

    Args:
        seen: All bytes so far, or the first `LARGEST` of them; not empty.
        tls: Whether the connection has to begin with a TLS handshake.
    """
    if len(seen) >= LARGEST:
        return True
    if not tls:
        return END_OF_HEAD in seen or not seen[:1].isalpha()
    if seen[:1] != _HANDSHAKE:
        return True
    length = _RECORD_HEAD + int.from_bytes(seen[3:_RECORD_HEAD])
    return len(seen) >= max(length, _RECORD_HEAD)


CAN_HOLD = sys.platform == "linux"
# Number of times that the backlog looks at a connection. A head comes in one piece or two; a client
# that sends it byte by byte is passed on, and spends the budgets of a served connection.
_MAX_LOOKS = 64


@dataclass(eq=False, slots=True)
class Silent:
    """One silent connection: the client has not sent its whole request yet.

    Args:
        source: Address or group of addresses against whose rate limits the connection counts.
        deadline: Time by which the client has to send its request [s].
        looks: Number of times that the backlog has looked at new bytes.
    """

    connection: socket.socket
    source: str
    deadline: float
    looks: int = 0


class Backlog:
    """The silent connections of one acceptor, on a system with epoll.

    Args:
        acceptor: File descriptor of the listening socket, which is watched too.
        tls: Whether connections begin with a TLS handshake.
    """

    def __init__(self, acceptor: int, *, tls: bool) -> None:
        assert sys.platform == "linux"
        self._acceptor, self._tls = acceptor, tls
        # The first connection has the next deadline: all have the same time-out, and the clock is
        # monotonic.
        self._held: OrderedDict[int, Silent] = OrderedDict()
        self._events = select.EPOLLIN | select.EPOLLRDHUP | select.EPOLLET
        self._ends = select.EPOLLRDHUP | select.EPOLLHUP | select.EPOLLERR
        self._set, self._shown = select.epoll(), select.epoll()
        self._set.register(acceptor, select.EPOLLIN)
        self._shown.register(self._set.fileno(), select.EPOLLIN)

    def __len__(self) -> int:
        return len(self._held)

    def fileno(self) -> int:
        """Return the file descriptor of an epoll set, for the event loop to watch.

        The set is readable when `ready` would return a socket, unless `show` hides that.
        """
        return self._shown.fileno()

    def show(self, *, readable: bool) -> None:
        """Show ready files to the event loop, or hide them so that they do not wake the loop."""
        self._shown.modify(self._set.fileno(), select.EPOLLIN if readable else 0)

    def hold(self, connection: socket.socket, source: str, deadline: float) -> None:
        """Watch a connection until it has sent its request.

        Args:
            connection: Non-blocking socket.
            source: Address or group of addresses against whose rate limits the connection counts.
            deadline: Time by which the request has to come [s]; not earlier than the deadline of
                any connection that is in the backlog already.

        Raises:
            OSError: The system has no memory for another watched connection.
        """
        file = connection.fileno()
        self._set.register(file, self._events)
        self._held[file] = Silent(connection, source, deadline)

    def ready(self) -> tuple[int, bool] | None:
        """Find one socket to handle: the acceptor, or a connection that has sent bytes or ended.

        Returns:
            File descriptor, and whether the client will send nothing more; None if there is none.
        """
        found = self._set.poll(0, 1)
        return (found[0][0], bool(found[0][1] & self._ends)) if found else None

    def look(self, file: int, *, ends: bool) -> tuple[Silent | None, bool]:
        """Look at a connection's bytes; remove it from the backlog if it can be served or ended.

        Args:
            file: File descriptor from `ready`.
            ends: Whether the client will send nothing more, as `ready` has returned it.

        Returns:
            The removed connection, and whether it is to be served; None for the connection if it
            stays in the backlog.
        """
        one = self._held.get(file)
        if one is None:
            return None, False
        one.looks += 1
        try:
            seen = one.connection.recv(LARGEST, socket.MSG_PEEK)
        except BlockingIOError:
            return None, False
        except OSError:
            seen = b""
        asked = bool(seen) and has_asked(seen, tls=self._tls)
        if seen and not ends and not asked and one.looks < _MAX_LOOKS:
            return None, False
        self._forget(file)
        return one, asked or (bool(seen) and not ends)

    def next_deadline(self) -> float | None:
        """Return the earliest deadline of a connection in the backlog [s], or None."""
        return next(iter(self._held.values())).deadline if self._held else None

    def overdue(self, now: float, limit: int) -> list[Silent]:
        """Remove from the backlog, and return, at most `limit` connections that are overdue."""
        found: list[Silent] = []
        for one in self._held.values():
            if one.deadline > now or len(found) == limit:
                break
            found.append(one)
        for one in found:
            self._forget(one.connection.fileno())
        return found

    def close(self) -> list[Silent]:
        """Stop watching; return the connections that were in the backlog."""
        held = list(self._held.values())
        self._held.clear()
        self._shown.close()
        self._set.close()
        return held

    def _forget(self, file: int) -> None:
        del self._held[file]
        self._set.unregister(file)


_OUT_OF_FILES = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
# Work that is done within `_WINDOW`, in units of about 30 us: 1 ms until a tick has its turn, and
# a quarter of a core. The system would stop a process of real-time priority that uses a whole core
# for 50 ms of each second. Accepting, looking at or turning away a connection costs one unit;
# passing a connection to asyncio costs eight (`_TAKING`).
_WORK_AT_ONCE = 32
_WINDOW = 4e-3  # s
_TAKING = 8
_LET_IN_AT_ONCE = 8  # connections accepted before the acceptor looks for connections with a request
_ENDED_AT_ONCE = 64  # silent connections closed at a time; 0.7 ms
# Bytes of a connection that the kernel buffers in each direction; Linux doubles the number for its
# own records. A download over a round trip of 250 ms then still reaches 0.25 to 0.5 MB/s; without a
# bound the kernel keeps 4 MB and more for a client that does not read.
KERNEL_BUFFER = 64 * 1024
_NO_MEMORY = Refusal("this machine has no more memory for connections", 5.0)


class Acceptor(socket.socket):
    """Listening socket for one address of a server.

    The event loop watches `fileno`, the epoll set of the backlog: it contains the silent
    connections and the listening socket. On systems without epoll, `accept` passes every connection
    on at once.

    Args:
        limiter: Limiter that admits connections by their rate limits.
        loop: Event loop that serves the connections and calls the timers of the acceptor.
        tls: Whether connections begin with a TLS handshake.
    """

    def __init__(
        self,
        family: int,
        limiter: ConnectionLimiter,
        loop: asyncio.AbstractEventLoop,
        *,
        tls: bool = False,
    ) -> None:
        super().__init__(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        self._own = super().fileno()
        self._backlog = Backlog(self._own, tls=tls) if CAN_HOLD else None
        self._limiter, self._loop = limiter, loop
        self._turns = Turns(loop.call_soon) if tls else None
        self._work = 0  # units of work done within this window
        self._in_window = False
        self._timer: asyncio.TimerHandle | None = None
        # A spare file descriptor, closed when the process has no more: otherwise a connection could
        # be neither accepted nor closed, and the listening socket would stay readable.
        self._spare: int | None = None

    @classmethod
    def opened(
        cls,
        address: Any,
        family: int,
        limiter: ConnectionLimiter,
        loop: asyncio.AbstractEventLoop,
        *,
        tls: bool = False,
    ) -> Acceptor:
        """Open a listening socket on an address; raises OSError."""
        acceptor = cls(family, limiter, loop, tls=tls)
        try:
            if os.name == "posix":
                acceptor.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if family == socket.AF_INET6:
                acceptor.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            # Accepted connections inherit both sizes.
            acceptor.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BUFFER)
            acceptor.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BUFFER)
            acceptor.setblocking(False)
            acceptor.bind(address)
            acceptor.listen(128)
        except OSError:
            acceptor.close()
            raise
        return acceptor

    @property
    def silent(self) -> int:
        """Number of connections that have not sent a request yet."""
        return 0 if self._backlog is None else len(self._backlog)

    def fileno(self) -> int:
        """Return the file descriptor that the event loop has to watch."""
        return super().fileno() if self._backlog is None else self._backlog.fileno()

    def accept(self) -> tuple[socket.socket, Any]:
        """Return the next connection that has sent a request; BlockingIOError if there is none."""
        if not self._in_window:
            self._in_window = True
            if self._backlog is None:  # a pause would spin: the socket stays readable meanwhile
                self._loop.call_soon(self._go_on)
            else:
                self._loop.call_later(_WINDOW, self._go_on)
        while self._work < _WORK_AT_ONCE:
            if self._backlog is None:
                return self._taken(*self._let_in())
            ready = self._backlog.ready()
            if ready is None:
                break
            file, ends = ready
            if file == self._own:
                self._let_several_in(self._backlog)
                continue
            self._work += 1
            one, asked = self._backlog.look(file, ends=ends)
            if one is None:
                continue
            if not asked:
                self._end(one)
                continue
            try:
                peer = one.connection.getpeername()
            except OSError:  # gone already
                self._end(one)
                continue
            return self._taken(one.connection, one.source, peer)
        if self._backlog is not None and self._work >= _WORK_AT_ONCE:
            self._backlog.show(readable=False)
        raise BlockingIOError

    def close(self) -> None:
        """Stop listening, and close the connections that have not sent a request."""
        spare, self._spare = getattr(self, "_spare", None), None
        if spare is not None:
            os.close(spare)
        backlog, self._backlog = getattr(self, "_backlog", None), None
        if backlog is not None:
            for one in backlog.close():
                self._end(one)
        timer: asyncio.TimerHandle | None = getattr(self, "_timer", None)
        if timer is not None:
            timer.cancel()
        super().close()

    def _go_on(self) -> None:
        if self._backlog is not None and self._work >= _WORK_AT_ONCE:
            self._backlog.show(readable=True)
        self._in_window, self._work = False, 0

    def _let_in(self) -> tuple[socket.socket, str, Any]:
        """Accept the next connection that the limiter admits, and let the limiter count it.

        Raises:
            BlockingIOError: No connection waits, or the work of this window is used up.
        """
        while self._work < _WORK_AT_ONCE:
            self._work += 1
            self._keep_spare()
            try:
                connection, peer = super().accept()
            except OSError as error:
                if error.errno not in _OUT_OF_FILES:
                    raise
                self._turn_away_without_files(error)
                continue
            source = self._limiter.source_of_peer(peer)
            refusal = self._limiter.admit(source)
            if refusal is None:
                return connection, source, peer
            turn_away(connection, refusal)
            sentence = f"a connection from {source} was refused: {refusal.why}"
            self._limiter.tell(source, "refused", sentence)
        raise BlockingIOError

    def _let_several_in(self, backlog: Backlog) -> None:
        deadline = self._limiter.clock.now() + HEAD_TIMEOUT
        for _ in range(_LET_IN_AT_ONCE):
            try:
                connection, source, _ = self._let_in()
            except (BlockingIOError, ConnectionAbortedError):
                break
            connection.setblocking(False)
            try:
                backlog.hold(connection, source, deadline)
            except OSError as error:
                turn_away(connection, _NO_MEMORY, 503)
                self._limiter.sources.leave(source)
                self._limiter.tell("no files", "no_files", f"{error}", warning=True)
        if self._timer is None and len(backlog):
            self._timer = self._loop.call_later(HEAD_TIMEOUT, self._end_overdue)

    def _taken(self, connection: socket.socket, source: str, peer: Any) -> tuple[Taken, Any]:
        """Wrap an admitted connection for asyncio; it counts until its socket closes."""
        self._work += _TAKING
        taken = Taken(self.family, self.type, self.proto, fileno=connection.detach())
        taken.turns = self._turns
        self._limiter.keep(taken, source)
        return taken, peer

    def _end_overdue(self) -> None:
        """Close at most `_ENDED_AT_ONCE` connections that have not sent a request in time."""
        self._timer = None
        if self._backlog is None:
            return
        limiter = self._limiter
        now = limiter.clock.now()
        for one in self._backlog.overdue(now, _ENDED_AT_ONCE):
            limiter.traffic.refused["no request"] += 1
            limiter.tell(
                one.source, "no_request", f"{one.source} sent no request in {HEAD_TIMEOUT:g} s"
            )
            self._end(one)
        due = self._backlog.next_deadline()
        if due is not None:
            self._timer = self._loop.call_later(max(0.0, due - now), self._end_overdue)

    def _end(self, one: Silent) -> None:
        one.connection.close()
        self._limiter.sources.leave(one.source)

    def _keep_spare(self) -> None:
        if self._spare is None:
            with contextlib.suppress(OSError):
                self._spare = os.open(os.devnull, os.O_RDONLY)

    def _turn_away_without_files(self, error: OSError) -> None:
        if self._spare is not None:
            os.close(self._spare)
            self._spare = None
            with contextlib.suppress(OSError):
                connection, _ = super().accept()
                turn_away(connection, Refusal("this machine has no more open files", 5.0), 503)
        sentence = f"connections are refused: {error.strerror}"
        self._limiter.tell("no files", "no_files", sentence, warning=True)
