"""A connection that watches the room: it brings the tips and forces of everybody, and the names."""

from __future__ import annotations

from typing import Final

from cohaptic.clock import Clock
from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import HEADER
from cohaptic.protocol.messages import Error, UserJoined, UserLeft, encode_control
from cohaptic.protocol.scene_users import MAX_USERS, SceneUsers, decode_users
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import Watch, Watching, decode_watch_control
from cohaptic_client.network.conversation import Refused
from cohaptic_client.network.link import Data, Link
from cohaptic_client.settings import ClientSettings

# Refusals after which watching is tried again. Any other will come again, and would count against
# the rate limits of everybody behind the same address.
PASSING: Final = frozenset({CloseCode.SERVER_STOPS.value, CloseCode.OBJECT_CHANGED.value})


class Watcher:
    """Watches a room over one connection.

    Attributes:
        watching: The server's answer, with the body and the session; None without a connection.
        names: Names of the users in the room, by number; empty without a connection.
        scene: Newest scene, in the world frame; None without a connection, or before its first.
    """

    def __init__(self, settings: ClientSettings, clock: Clock) -> None:
        self.watching: Watching | None = None
        self.names: dict[int, str] = {}
        self.scene: SceneUsers | None = None
        self._settings = settings
        self._link = Link(settings.url, clock, settings.up, settings.down, settings.ca_file)

    async def run(self, token: str = "", rate: float = 30.0) -> str:
        """Watch until the connection ends; return the reason why it ended.

        Args:
            token: Token of the invitation or the session; empty for none.
            rate: Largest rate of scenes, from 1 to 60 [1/s].

        Raises:
            ServerLost: No server answers.
            Refused: The server does not let this client watch.
            RemoteProtocolError: The server has broken the protocol.
        """
        await self._link.open()
        try:
            watch = Watch(
                protocol=PROTOCOL_VERSION,
                encoding="forces",
                rate=rate,
                mesh="quantised",
                token=token or None,
            )
            self._link.send(encode_control(watch))
            return await self._link.receive(self._hear)
        finally:
            self.watching, self.names, self.scene = None, {}, None
            await self._link.close()

    def _hear(self, data: Data) -> None:
        if isinstance(data, str):
            message = decode_watch_control(data)
            if isinstance(message, Error):
                raise Refused(message.code, message.message, message.field)
            if isinstance(message, Watching):
                self.watching = message
                self.names = {user.user: user.name for user in message.users}
            elif isinstance(message, UserJoined):  # also for a new name
                if len(self.names) >= MAX_USERS and message.user not in self.names:
                    limit = f"at most {MAX_USERS} users of a room"
                    raise RemoteProtocolError("user_joined", message.user, limit)
                self.names[message.user] = message.name
            elif isinstance(message, UserLeft):
                self.names.pop(message.user, None)
        elif len(data) < HEADER.size:
            raise RemoteProtocolError("frame length", len(data), f"at least {HEADER.size} bytes")
        elif data[1] == FrameKind.SCENE:
            # Without the surface: no script needs a mesh for the places of hands.
            self.scene = decode_users(data)
            self._link.send(Ack(self.scene.tick).encode())
