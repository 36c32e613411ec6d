"""A second connection, which watches the room: it brings the tips and forces of everybody.

Who is in the room, and by which name, the first connection says.
"""

from __future__ import annotations

from cohaptic.clock import Clock
from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import HEADER
from cohaptic.protocol.messages import Error, encode_control
from cohaptic.protocol.scene_users import SceneUsers, decode_users
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import Watch, decode_watch_control
from cohaptic_client.network.conversation import Refused
from cohaptic_client.network.link import Data, Link
from cohaptic_client.settings import ClientSettings


class Watcher:
    """Watches a room over one connection.

    Attributes:
        scene: Newest scene, in the world frame; None without a connection, or before its first.
    """

    def __init__(self, settings: ClientSettings, clock: Clock) -> None:
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
            self.scene = None
            await self._link.close()

    def _hear(self, data: Data) -> None:
        if isinstance(data, str):
            message = decode_watch_control(data)
            if isinstance(message, Error):
                raise Refused(message.code, message.message, message.field)
        elif len(data) < HEADER.size:
            raise RemoteProtocolError("frame length", len(data), f"at least {HEADER.size} bytes")
        elif data[1] == FrameKind.SCENE:
            # Without the surface: no script needs a mesh for the places of hands.
            self.scene = decode_users(data)
            self._link.send(Ack(self.scene.tick).encode())
