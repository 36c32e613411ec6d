"""A listening socket that turns away whom the server has no budget for, before it costs anything.

asyncio makes a transport, a protocol and a task of every connection, which takes 0.3 ms; one that
is turned away here costs 20 us. It is told why in HTTP, which everybody who comes speaks.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
from collections.abc import Callable
from typing import Any

from cohaptic_server.guard.sources import Refusal
from cohaptic_server.shell.gate import Gate, Taken, Turns, source_of_peer

_OUT_OF_FILES = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
# Connections that are taken, or turned away, before other events have their turn: 1 ms of each.
_TAKEN_AT_ONCE = 4
_REFUSED_AT_ONCE = 32
# Bytes that wait in the kernel for a connection, each way; Linux takes twice as much for its own
# records. A download over 250 ms of round trip then still has 0.25 to 0.5 MB/s; without a bound
# the kernel keeps 4 MB and more for one who does not read.
KERNEL_BUFFER = 64 * 1024
# Nothing is sent there: the system says from which address it would. The first stands for the rest
# of the world, the others for networks that are not its way there (RFC 5737, 1918, 3849).
_TARGETS = (
    (socket.AF_INET, "192.0.2.1"),
    (socket.AF_INET, "192.168.255.254"),
    (socket.AF_INET, "10.255.255.254"),
    (socket.AF_INET, "172.31.255.254"),
    (socket.AF_INET6, "2001:db8::1"),
)
_PORT = 9


class Door(socket.socket):
    """One address that a server listens on.

    Args:
        family: Of the address.
        gate: Knows whom there is a budget for.
        soon: Calls back once other events have had their turn.
        tls: Whether connections begin with a handshake.
    """

    def __init__(
        self,
        family: int,
        gate: Gate,
        soon: Callable[[Callable[[], None]], object],
        *,
        tls: bool = False,
    ) -> None:
        super().__init__(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        self._gate = gate
        self._soon = soon
        self._turns = Turns(soon) if tls else None
        self._taken = self._refused = 0  # since other events had their turn
        # A file to give up when there are no more: a connection that cannot be accepted could
        # not be closed either, and would be asked about again and again.
        self._spare: int | None = None

    @classmethod
    def opened(
        cls,
        address: Any,
        family: int,
        gate: Gate,
        soon: Callable[..., object],
        *,
        tls: bool = False,
    ) -> Door:
        """Listen; raises OSError."""
        door = cls(family, gate, soon, tls=tls)
        try:
            if os.name == "posix":
                door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if family == socket.AF_INET6:
                door.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            # Connections inherit them.
            door.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BUFFER)
            door.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BUFFER)
            door.setblocking(False)
            door.bind(address)
            door.listen(128)
        except OSError:
            door.close()
            raise
        return door

    def accept(self) -> tuple[socket.socket, Any]:
        """The next connection that may come in; BlockingIOError if there is none for now."""
        while True:
            if self._taken >= _TAKEN_AT_ONCE or self._refused >= _REFUSED_AT_ONCE:
                raise BlockingIOError
            if self._taken == self._refused == 0:
                self._soon(self._go_on)
            self._keep_spare()
            try:
                connection, peer = super().accept()
            except OSError as error:
                if error.errno not in _OUT_OF_FILES:
                    raise
                self._refused += 1
                self._turn_away_without_files(error)
                continue
            source = source_of_peer(peer)
            taken = Taken(fileno=connection.detach())
            taken.turns = self._turns
            refusal = self._gate.enter(taken, source)
            if refusal is None:
                self._taken += 1
                return taken, peer
            self._refused += 1
            turn_away(taken, refusal)
            told = f"a connection from {source} was refused: {refusal.why}"
            self._gate.tell(source, "refused", told)

    def close(self) -> None:
        """Listen no more."""
        spare, self._spare = getattr(self, "_spare", None), None
        if spare is not None:
            os.close(spare)
        super().close()

    def _go_on(self) -> None:
        self._taken = self._refused = 0

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
        told = f"connections are refused: {error.strerror}"
        self._gate.tell("no files", "no_files", told, warning=True)


def turn_away(connection: socket.socket, refusal: Refusal, status: int = 429) -> None:
    """Tell why, as far as that goes without waiting, and close."""
    phrase = "Too Many Requests" if status == 429 else "Service Unavailable"
    text = f"{refusal.why}\n".encode()
    head = (
        f"HTTP/1.1 {status} {phrase}\r\nConnection: close\r\nContent-Type: text/plain\r\n"
        f"Retry-After: {int(refusal.retry) + 1}\r\nContent-Length: {len(text)}\r\n\r\n"
    )
    with contextlib.suppress(OSError):
        connection.setblocking(False)
        connection.send(head.encode() + text)
        connection.shutdown(socket.SHUT_WR)
    connection.close()


def machine_addresses() -> tuple[str, ...]:
    """Each once, the one on the way to the world first; none without a network."""
    found: list[str] = []
    for family, target in _TARGETS:
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect((target, _PORT))
                found.append(str(probe.getsockname()[0]))
        except OSError:
            continue  # no such network here
    return tuple(dict.fromkeys(found))
