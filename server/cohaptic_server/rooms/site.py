"""What the server itself answers: the list of rooms, and why somebody cannot come into one."""

from __future__ import annotations

import socket
from collections.abc import Callable, Sequence

from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request as HttpRequest
from websockets.http11 import Response

from cohaptic_server.rooms.listing import RoomState, answer, turned_away
from cohaptic_server.rooms.process.handing_over import HandedDoor, hand_over, handing_pair
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.gate import Gate
from cohaptic_server.shell.http import DOWNLOAD_TIMEOUT, HostCheck, plain, response, too_many
from cohaptic_server.shell.listener import Listener, serve_doors
from cohaptic_server.shell.refusal import refuse
from cohaptic_server.shell.wire import Wire


class Site:
    """A place for connections that no room takes.

    Args:
        settings: Of what all rooms have in common.
        gate: Of this place alone; the doors have their own.
        rooms: What there is to tell.
        left: Called with the source of each connection that has ended.
        listed: Whether anybody may know which rooms there are.
    """

    def __init__(
        self,
        settings: ServerSettings,
        gate: Gate,
        rooms: Callable[[], Sequence[RoomState]],
        left: Callable[[str], None],
        *,
        listed: bool = True,
    ) -> None:
        self._check, self._base = HostCheck(settings), settings.base_path
        self._gate, self._rooms, self._left = gate, rooms, left
        self._listed = listed
        self._handed: dict[int, str] = {}
        self._door: socket.socket | None = None
        self._listener: Listener | None = None

    async def start(self) -> None:
        """Serve whoever is handed over."""
        self._door, inner = handing_pair()
        door = HandedDoor(inner, self._gate, self._ended)
        self._listener = await serve_doors(
            self._handle, self._process, [door], self._gate, base=self._base
        )

    def stop(self) -> None:
        """Serve nobody any more."""
        if self._listener is not None:
            self._listener.close()
        if self._door is not None:
            self._door.close()

    def take(self, connection: socket.socket, number: int, source: str) -> bool:
        """Hand a connection to this place; returns whether it takes it."""
        if self._door is None or not hand_over(self._door, connection, number):
            return False
        self._handed[number] = source
        return True

    def _ended(self, number: int) -> None:
        source = self._handed.pop(number, None)
        if source is not None:
            self._left(source)

    async def _process(self, connection: ServerConnection, request: HttpRequest) -> Response | None:
        assert isinstance(connection, Wire)
        refusal = connection.come_from(request.headers)
        if refusal is not None:
            return response(too_many(plain(request), refusal))
        refused = self._check(connection, request)
        if refused is not None or "Upgrade" in request.headers:
            return refused
        connection.close_timeout = DOWNLOAD_TIMEOUT
        rooms, base = self._rooms(), self._base
        return response(answer(plain(request), rooms, listed=self._listed, base=base))

    async def _handle(self, ws: Wire) -> None:
        target = "" if ws.request is None else ws.request.path
        code, why = turned_away(target, self._rooms(), listed=self._listed)
        await refuse(ws, code, why)
