"""Message from server to watcher: every user's contact, and the surface if requested.

A scene is state, not an event: the newest replaces every older one. A frame without a surface has
only the users' records; a page with the Green's functions of the body computes the surface itself.
"""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic.control.room_lag import NO_LAG, RoomLag
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import HEADER
from cohaptic.protocol.patch import MAX_MARGIN
from cohaptic.protocol.scene_surface import Surface
from cohaptic.protocol.scene_users import (
    SCENE_BODY,
    SURFACE_FLAG,
    USER_SIZE,
    UserRecord,
    check_head,
    decode_users,
)
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.version import PROTOCOL_VERSION


@dataclass(frozen=True, slots=True)
class Scene:
    """All users at one tick, with the surface if requested.

    Args:
        tick: Simulation tick, from 1.
        t_server: Time of the tick on the server's clock [s].
        users: All users in the room, and users who left but whose force still fades.
        surface: Displacement of the vertices of the rest mesh; None in a frame without a surface.
        room: Lag, coupling and margin of the room (science 3.8).
    """

    tick: int
    t_server: float
    users: tuple[UserRecord, ...]
    surface: Surface | None = None
    room: RoomLag = NO_LAG

    def encode(self, traversal: Traversal) -> bytes:
        """The frame of this scene; raises LocalProtocolError when a value is out of its limits.

        Args:
            traversal: Traversal of the rest mesh.
        """
        records = b"".join(user.encode() for user in self.users)
        surface = b"" if self.surface is None else self.surface.encode(traversal)
        return encode_scene(self.tick, self.t_server, self.room, records, surface)

    @classmethod
    def decode(cls, data: bytes, traversal: Traversal) -> Scene:
        """The scene in a frame; raises RemoteProtocolError for any invalid bytes.

        Args:
            traversal: Traversal of the rest mesh, which bounds the size that is inflated.
        """
        tick, t_server, users, room, end = decode_users(data)
        surface = Surface.decode(data[end:], traversal) if end else None
        return cls(tick, t_server, users, surface, room)


def encode_scene(
    tick: int, t_server: float, room: RoomLag, records: bytes, surface: bytes
) -> bytes:
    """Make a scene frame from encoded parts, so that one encoded surface serves many frames.

    Args:
        t_server: Time of the tick on the server's clock [s].
        room: Lag, coupling and margin of the room.
        records: Encoded records of the users, one behind the other.
        surface: Encoded surface; empty for a frame without a surface.

    Raises:
        LocalProtocolError: A value is out of its limits.
    """
    users = len(records) // USER_SIZE
    check_head(tick, t_server, users, room, remote=False)
    flags = SURFACE_FLAG if surface else 0
    head = HEADER.pack(PROTOCOL_VERSION, FrameKind.SCENE, flags)
    times = (room.lag, room.coupling, min(room.margin, MAX_MARGIN))
    return head + SCENE_BODY.pack(tick, t_server, users, *times) + records + surface
