"""A second connection, which watches the room: it brings the tips and forces of everybody."""

from __future__ import annotations

from functools import partial

from cohaptic.clock import Clock
from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import HEADER
from cohaptic.protocol.messages import Error, RoomUser, UserJoined, UserLeft, encode_control
from cohaptic.protocol.scene_users import SceneUsers, decode_users
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import Watch, Watching, decode_watch_control
from cohaptic_client.network.link import Data, Link
from cohaptic_client.settings import ClientSettings


class Watcher:
    """Watches a room over one connection.

    Attributes:
        scene: Newest scene, in the world frame; None before the first.
        names: Names of the users in the room, by number.
    """

    def __init__(self, settings: ClientSettings, clock: Clock) -> None:
        self.scene: SceneUsers | None = None
        self.names: dict[int, str] = {}
        self._settings = settings
        self._link = Link(settings.url, clock, settings.up, settings.down, settings.ca_file)

    async def run(self, token: str = "", rate: float = 30.0) -> str:
        """Watch until the connection ends; return the reason why it ended.

        Args:
            token: Token of the invitation or the session; empty for none.
            rate: Largest rate of scenes, from 1 to 60 [1/s].

        Raises:
            ServerLost: No server answers.
            RemoteProtocolError: The server has broken the protocol.
        """
        await self._link.open()
        reasons = list[str]()
        try:
            watch = Watch(
                protocol=PROTOCOL_VERSION,
                encoding="forces",
                rate=rate,
                mesh="quantised",
                token=token or None,
            )
            self._link.send(encode_control(watch))
            ended = await self._link.receive(partial(self._hear, reasons))
            return reasons[0] if reasons else ended
        finally:
            await self._link.close()

    def _hear(self, reasons: list[str], data: Data) -> None:
        if isinstance(data, str):
            message = decode_watch_control(data)
            if isinstance(message, Watching):
                self.names = _names(message.users)
            elif isinstance(message, UserJoined):
                self.names[message.user] = message.name
            elif isinstance(message, UserLeft):
                self.names.pop(message.user, None)
            elif isinstance(message, Error):
                reasons.append(message.message)
        elif len(data) < HEADER.size:
            raise RemoteProtocolError("frame length", len(data), f"at least {HEADER.size} bytes")
        elif data[1] == FrameKind.SCENE:
            # Without the surface: no script needs a mesh for the places of hands.
            scene = decode_users(data)
            self.scene = scene
            self._link.send(Ack(scene.tick).encode())


def _names(users: tuple[RoomUser, ...]) -> dict[int, str]:
    return {user.user: user.name for user in users}
