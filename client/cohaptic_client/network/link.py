"""One connection to a server: a websocket, with the latency that the settings inject.

Both directions pass through a `DelayLine`, so that injected latency behaves as in a stream: one
delay per direction, and messages stay in order. Without a delay, messages pass at once.
"""

from __future__ import annotations

import asyncio
import ssl
import struct
from collections.abc import Callable
from typing import Final
from urllib.parse import urlsplit

from websockets.asyncio.client import connect
from websockets.exceptions import (
    ConnectionClosed,
    InvalidHandshake,
    InvalidProxy,
    InvalidStatus,
    InvalidURI,
    ProxyError,
)
from websockets.typing import Subprotocol

from cohaptic.clock import Clock
from cohaptic.errors import AnotherObject, CloseCode, ServerLost, ServerUnreachable, one_line
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import HEADER
from cohaptic.protocol.rest_mesh import MAX_BYTES
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.runtime.direct_loop import DirectLoop
from cohaptic.runtime.transport import WEBSOCKET_OPTIONS, tune
from cohaptic.simulated.delay_line import DelayLine, LinkSettings
from cohaptic_client.address import proxy_for, silence, trust, why_not_trusted, with_slash
from cohaptic_client.network.wire import Wire

Data = str | bytes
ROW_COUNT: Final = struct.Struct("<H")  # the first field of a frame of rows
MAX_INBOUND_BYTES = MAX_BYTES  # the largest message is a rest mesh, then a full room's welcome

_TELLS_WHY: Final = (429, 503)  # too many, or no room at present: a sentence of the server's own
# s without an answer until the next address of a name is tried beside the first (RFC 8305): one of
# the machines that share a name may have vanished.
_NEXT_ADDRESS: Final = 0.25


class Delayed:
    """A delay line on the running event loop; it calls `deliver` with each message when due."""

    def __init__(
        self, settings: LinkSettings, clock: Clock, deliver: Callable[[Data], None]
    ) -> None:
        self._at_once = settings.at_once
        self._line: DelayLine[Data] = DelayLine(settings)
        self._clock = clock
        self._deliver = deliver
        self._timer: asyncio.TimerHandle | None = None

    def push(self, data: Data) -> None:
        """Put a message into the delay line; without a delay it is delivered at once."""
        if self._at_once:
            self._deliver(data)
            return
        self._line.push(data, self._clock.now())
        self._run()

    def _run(self) -> None:
        for data in self._line.pop_due(self._clock.now()):
            self._deliver(data)
        due = self._line.next_due()
        if due is not None and self._timer is None:
            wait = max(0.0, due - self._clock.now())
            self._timer = asyncio.get_running_loop().call_later(wait, self._wake)

    def _wake(self) -> None:
        self._timer = None
        self._run()

    def cancel(self) -> None:
        """Drop the messages that wait in the delay line."""
        if self._timer is not None:
            self._timer.cancel()


class Link:
    """One connection to a server.

    Args:
        up: Latency injected from client to server.
        down: Latency injected from server to client.
        ca_file: File with the certificates to trust; empty for the system's certificates.

    Attributes:
        rows_dropped: Number of rows that did not leave, since earlier bytes were unsent.
    """

    def __init__(
        self, url: str, clock: Clock, up: LinkSettings, down: LinkSettings, ca_file: str = ""
    ) -> None:
        self.url = url
        self._ca_file = ca_file
        self._clock = clock
        self._up, self._down = up, down
        self.rows_dropped = 0
        self._ws: Wire | None = None
        self._outbound: Delayed | None = None

    async def open(self) -> None:
        """Connect to the server.

        Raises:
            ServerLost: No cohaptic server answers; a later attempt may succeed.
            ServerUnreachable: The URL or the server's certificate is wrong.
        """
        trusted = trust(self.url, self._ca_file)
        proxy = None
        try:
            proxy = proxy_for(self.url)
            connection = await connect(
                with_slash(self.url),
                create_connection=Wire,
                subprotocols=[Subprotocol(SUBPROTOCOL)],
                proxy=proxy,
                max_size=MAX_INBOUND_BYTES,
                ssl=trusted,
                happy_eyeballs_delay=_NEXT_ADDRESS,
                **WEBSOCKET_OPTIONS,
            )
        except InvalidStatus as error:
            why = one_line((error.response.body or b"").decode(errors="replace").strip(), 200)
            if error.response.status_code not in _TELLS_WHY or not why:
                raise ServerLost(self.url, f"not a cohaptic server ({error})") from error
            raise ServerLost(self.url, f"the server says: {why}") from error
        except (ProxyError, InvalidProxy) as error:
            raise ServerLost(self.url, f"{silence(proxy)} ({error})") from error
        except InvalidHandshake as error:
            secure = "" if self.url.startswith("wss:") else "; try wss:// if it speaks TLS"
            raise ServerLost(self.url, f"not a cohaptic server ({error}){secure}") from error
        except ssl.SSLError as error:
            problem = why_not_trusted(error, urlsplit(self.url).hostname or "")
            if isinstance(error, ssl.SSLCertVerificationError):
                raise ServerUnreachable(self.url, problem) from error
            raise ServerLost(self.url, problem) from error  # a proxy may still be starting
        except (OSError, TimeoutError) as error:
            raise ServerLost(self.url, silence(proxy)) from error
        except (InvalidURI, ValueError) as error:  # ValueError: an impossible host or port
            problem = "not an address; expected ws://HOST:PORT"
            raise ServerUnreachable(self.url, problem) from error
        assert isinstance(connection, Wire)
        self._ws = connection
        tune(self._ws.transport.get_extra_info("socket"))
        self._outbound = Delayed(self._up, self._clock, self._write)
        loop = asyncio.get_running_loop()
        if isinstance(loop, DirectLoop):
            loop.read_directly(connection.transport, connection.data_received)

    def send(self, data: Data) -> None:
        """Send without waiting; drop a binary message while earlier bytes are still unsent."""
        assert self._outbound is not None
        self._outbound.push(data)

    async def receive(self, deliver: Callable[[Data], None]) -> str:
        """Call `deliver` for each message until the connection ends; return why it ended.

        Raises:
            AnotherObject: The server closed the connection because it has another object.
        """
        assert self._ws is not None
        failed: asyncio.Future[str] = asyncio.get_running_loop().create_future()

        def guarded(data: Data) -> None:
            # A timer may call this function, and an exception would be lost there.
            try:
                deliver(data)
            except Exception as error:
                if not failed.done():
                    failed.set_exception(error)

        inbound = Delayed(self._down, self._clock, guarded)
        self._ws.deliver = inbound.push
        pump = asyncio.ensure_future(self._pump(inbound))
        try:
            done, _ = await asyncio.wait({pump, failed}, return_when=asyncio.FIRST_COMPLETED)
            if pump in done and not failed.done():
                # The server's last message is still on its way through the injected delay.
                await asyncio.sleep(self._down.longest)
            return failed.result() if failed.done() else pump.result()
        finally:
            self._ws.deliver = None
            inbound.cancel()
            pump.cancel()

    async def _pump(self, inbound: Delayed) -> str:
        assert self._ws is not None
        try:
            while True:
                data = await self._ws.recv()
                self._ws.taken()
                inbound.push(data)
        except ConnectionClosed as closed:
            frame = closed.rcvd
            if frame and frame.code == CloseCode.OBJECT_CHANGED.value:
                raise AnotherObject from closed
            return frame.reason if frame and frame.reason else "the connection was lost"

    def _write(self, data: Data) -> None:
        assert self._ws is not None
        if isinstance(data, bytes) and self._ws.unsent > 0:
            if data[1] == FrameKind.ROWS:
                self.rows_dropped += ROW_COUNT.unpack_from(data, HEADER.size)[0]
            return  # only the newest sample counts: the next one follows a period later
        self._ws.write(data)

    async def close(self) -> None:
        """Close the connection with a closing handshake; may be called twice."""
        if self._outbound is not None:
            self._outbound.cancel()
        if self._ws is not None:
            await self._ws.close()
