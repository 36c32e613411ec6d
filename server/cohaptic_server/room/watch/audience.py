"""The watchers of one room, and the scene that all of them are shown. No I/O."""

from __future__ import annotations

from collections.abc import Mapping

from cohaptic.errors import LocalProtocolError
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.watch_messages import WatchedUser, Watching
from cohaptic_server.access.grants import OPEN, Grants
from cohaptic_server.room.body_frames import describe
from cohaptic_server.room.room import Room
from cohaptic_server.room.watch.scene_encoder import SceneEncoder, displacement, records
from cohaptic_server.room.watch.watcher import Watcher
from cohaptic_server.world.users import WorldState


class Audience:
    """All watchers of a room.

    Args:
        room: That is watched.
        model: Name of the body's Green's functions; None where its displacement is no sum of them.

    Attributes:
        watchers: At present.
        came: Number of watchers since the start.
        slow: How often a watcher fell behind.
        problem: Why the newest scene could not be sent; None if it could.
    """

    def __init__(self, room: Room, model: str | None) -> None:
        self.room = room
        self.model = model
        self.watchers: set[Watcher] = set()
        self.came = 0
        self.slow = 0
        self.problem: str | None = None
        self._vertices = len(room.body.mesh.vertices)
        traversal = Traversal.of(self._vertices, room.body.mesh.faces)
        self._encoder = SceneEncoder(traversal, follows_records=model is not None)

    def enter(
        self,
        watcher: Watcher,
        to_wall: float,
        grants: Grants = OPEN,
        session: str | None = None,
    ) -> None:
        """Add a watcher.

        Args:
            watcher: Who has sent its first message.
            to_wall: Offset of the server's clock to the wall's [s].
            grants: What it may do.
            session: Token with which it comes back; None if it needs none.

        Raises:
            RemoteProtocolError: There are too many watchers, or the body has too many vertices to
                be shown.
        """
        settings = self.room.settings
        self.room.watch_seats.check(len(self.watchers))
        self.room.frames.check_watchable()
        self.watchers.add(watcher)
        self.came += 1
        members = self.room.members.values()
        watcher.accept(
            Watching(
                simulation_period=settings.simulation_period,
                to_wall=to_wall,
                body=describe(self.room.body),
                model=self.model,
                users=tuple(WatchedUser(user=m.user, name=m.hello.name) for m in members),
                allow_latency=settings.allow_latency and grants.can_inject_latency,
                allow_fixed_gains=settings.allow_fixed_gains,
                allow_upload=settings.allow_upload,
                can_touch=grants.can_touch,
                room_admin=grants.room_admin,
                session=session,
            )
        )

    def leave(self, watcher: Watcher) -> None:
        """Remove a watcher, if it is one of the audience."""
        self.watchers.discard(watcher)

    def see(self, world: WorldState, patches: Mapping[int, Patch], now: float) -> None:
        """Take the world after a tick as the newest scene; costs nothing while nobody watches.

        Args:
            world: After the tick.
            patches: Of the tick, by user.
            now: Time of the tick [s].
        """
        if self.watchers and world.tick > self._encoder.tick:
            self._encoder.see(
                world.tick,
                now,
                records(world, patches),
                lambda: displacement(world, self._vertices),
                world.room,
            )

    def show(self, watcher: Watcher, now: float, *, clear: bool) -> None:
        """Queue the newest scene for a watcher if it is due.

        Args:
            watcher: Who is shown the scene.
            now: Time [s].
            clear: Whether all that was written to it before has left the process.
        """
        encoder = self._encoder
        if watcher.due(encoder.version, now, clear=clear):
            frame = self._frame(surface=watcher.wants_surface)
            if frame is not None:
                watcher.put_scene(frame, encoder.tick, encoder.version, now)
        elif clear and watcher.is_left_in_doubt(encoder.tick, encoder.version, now):
            frame = self._frame(surface=False)
            if frame is not None:
                watcher.put_sign_of_life(frame, encoder.tick, now)
        was_slow = watcher.slow
        watcher.handle_timer(now)
        self.slow += watcher.slow and not was_slow

    def _frame(self, *, surface: bool) -> bytes | None:
        """The newest scene; None, with `problem`, where a number of it has no place on the wire."""
        try:
            frame = self._encoder.frame(surface=surface)
        except LocalProtocolError as error:
            # For example, the body was pushed out of the range of coordinates. Users are not
            # affected.
            self.problem = str(error)
            return None
        self.problem = None
        return frame
