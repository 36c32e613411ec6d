"""A connection to the Haply service, which sends a message and waits a limited time for the answer.

The connection uses the protocol of the `websockets` library without the library's threads and
tasks, on a blocking socket: one thread does all the work, and a message wakes no other thread of
this process.
"""

from __future__ import annotations

import socket
from importlib import import_module
from typing import Any

from cohaptic.clock import Clock
from cohaptic.errors import one_line

LONGEST = 1 << 18  # bytes of a message; one about five devices with their configuration has 10 kB
_READ = 1 << 16
_HANDSHAKE = 2.0  # s; the service is on this machine


class ServiceGone(Exception):
    """The connection broke, or the program at the other end does not speak websocket."""


class ServiceSilent(Exception):
    """No answer came in time."""


class Service:
    """An open websocket connection to the service.

    Args:
        url: URL of the service.
        clock: Clock for the time-outs.

    Raises:
        ConnectionRefusedError: Nothing listens at the URL.
        OSError: The connection fails for another reason, such as a time-out.
        ServiceGone: The program that listens at the URL does not speak websocket.
    """

    def __init__(self, url: str, clock: Clock) -> None:
        self._clock = clock
        # These modules of `websockets` need neither asyncio nor TLS, and are imported only on use.
        client = import_module("websockets.client")
        try:
            uri = import_module("websockets.uri").parse_uri(url)
        except Exception as error:  # any error of the library
            raise ServiceGone(one_line(str(error))) from error
        self._text: int = import_module("websockets.frames").Opcode.TEXT
        self._socket = socket.create_connection((uri.host, uri.port), _HANDSHAKE)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._protocol: Any = client.ClientProtocol(uri, max_size=LONGEST)
        self._parts: list[bytes] = []
        self._whole: list[str] = []
        self._over = ""
        try:
            self._protocol.send_request(self._protocol.connect())
            self._flush()
            self._open(clock.now() + _HANDSHAKE)
        except BaseException:
            self._socket.close()
            raise

    def exchange(self, text: str, timeout: float) -> str:
        """Send a message and return the answer.

        Raises:
            ServiceSilent: No answer came within `timeout` [s].
            ServiceGone: The connection has ended.
        """
        self.send(text)
        return self.receive(timeout)

    def send(self, text: str) -> None:
        """Send a message; raise ServiceGone if the connection has ended."""
        try:
            self._protocol.send_text(text.encode())
        except Exception as error:  # an error of the library, whose types are imported only on use
            raise ServiceGone(one_line(str(error))) from error
        self._flush()

    def receive(self, timeout: float) -> str:
        """Wait up to `timeout` [s] for the next message and return it; raise as `exchange`."""
        until = self._clock.now() + timeout
        while not self._whole:
            self._take(until)
        return self._whole.pop(0)

    def waiting(self) -> int:
        """Return the number of arrived messages that `receive` has not yet returned."""
        return len(self._whole)

    def close(self) -> None:
        """Close the connection without waiting for the other end; may be called twice."""
        try:
            self._protocol.send_close()
            self._flush()
        except Exception:
            pass  # the connection is gone, or was closed before
        self._socket.close()

    def _open(self, until: float) -> None:
        state = import_module("websockets.protocol").State
        while self._protocol.state is state.CONNECTING:
            try:
                self._take(until)
            except ServiceSilent as error:
                raise ServiceGone("it does not answer") from error
            if self._protocol.handshake_exc is not None:
                raise ServiceGone(one_line(str(self._protocol.handshake_exc)))

    def _take(self, until: float) -> None:
        """Read data until `until` [s] and collect messages; past it, read only data already there.

        If this process stood still past `until`, the answer may have arrived meanwhile: the process
        was late, not the service.
        """
        if self._over:
            raise ServiceGone(self._over)
        left = until - self._clock.now()
        try:
            self._socket.settimeout(max(0.0, left))
            data = self._socket.recv(_READ)
        except (TimeoutError, BlockingIOError) as error:
            raise ServiceSilent from error
        except OSError as error:
            raise ServiceGone(str(error)) from error
        if data:
            self._protocol.receive_data(data)
        else:
            self._protocol.receive_eof()
        for event in self._protocol.events_received():
            self._sort(event)
        self._flush()  # answers to pings
        if not data or self._protocol.close_expected():
            why = self._protocol.handshake_exc or "it closed the connection"
            self._over = one_line(str(why))
            if not self._whole:  # return the messages from before the end first
                raise ServiceGone(self._over)
        if left <= 0.0 and not self._whole:
            raise ServiceSilent

    def _sort(self, event: Any) -> None:
        if not hasattr(event, "opcode"):  # the answer to the handshake
            return
        # The service sends no binary messages: one that comes is decoded as text that is no JSON.
        if event.opcode in (0, 1, 2):  # continuation, text, binary: RFC 6455, section 5.2
            self._parts.append(event.data)
            if event.fin:
                self._whole.append(b"".join(self._parts).decode(errors="replace"))
                self._parts.clear()

    def _flush(self) -> None:
        try:
            self._socket.settimeout(_HANDSHAKE)
            for data in self._protocol.data_to_send():
                if data:
                    self._socket.sendall(data)
        except OSError as error:
            raise ServiceGone(str(error)) from error
