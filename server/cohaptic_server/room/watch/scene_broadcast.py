"""The watchers of one room, and the scene that all of them are shown. No I/O.

The scene of a tick is encoded on demand, once with and once without the surface. A scene counts as
changed only if a position or a force has changed by more than a screen or a plot can show;
otherwise the previous scene stays valid.

This is the only module that reads the state of the simulation for display.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from cohaptic.control.room_lag import NO_LAG, RoomLag
from cohaptic.control.tick_ledger import NOTHING_CUT
from cohaptic.errors import LocalProtocolError
from cohaptic.protocol.messages import RoomUser
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.scene import encode_scene
from cohaptic.protocol.scene_surface import FINEST, Surface
from cohaptic.protocol.scene_users import MAX_CURVATURE, MAX_LOOP_DELAY, MAX_USERS, UserRecord
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.watch_messages import Watching
from cohaptic_server.access.keys import OPEN, Grants
from cohaptic_server.numeric import Floats, vec3
from cohaptic_server.room.body_frames import describe
from cohaptic_server.room.room import Room
from cohaptic_server.room.watch.watcher import Watcher
from cohaptic_server.world.state import UserState
from cohaptic_server.world.users import WorldState


def records(world: WorldState, patches: Mapping[int, Patch]) -> tuple[UserRecord, ...]:
    """Return one record for each user; a user who has left counts until its force has faded.

    Args:
        world: State of the simulation after a tick.
        patches: Patches of the same tick, by user number; users who have left have no patch.
    """
    users = list(world.users.values())[:MAX_USERS]
    return tuple(_record(user, patches.get(user.touch.user)) for user in users)


def displacement(world: WorldState, vertices: int) -> Floats:
    """Return the displacement of all surface vertices after the last tick, (vertices, 3) [m]."""
    if world.response is None:
        return np.zeros((vertices, 3))
    return world.response.displacement


def _record(user: UserState, patch: Patch | None) -> UserRecord:
    touch, contact = user.touch, user.contact
    return UserRecord(
        user=touch.user,
        probe=touch.probe,
        foot=vec3(contact.foot),
        force=user.applied,
        c_ii=0.0 if patch is None else patch.c_ii,
        k_o_coupled=0.0 if patch is None else user.k_o_coupled,
        k_h=0.0 if patch is None else patch.k_h,
        integral_gain=0.0 if patch is None else patch.integral_gain,
        loop_delay=min(user.delay.value, MAX_LOOP_DELAY),
        normal=vec3(contact.normal),
        law=touch.who.law,
        geometry=touch.who.geometry,
        presence=user.presence,
        curvature=(
            0.0 if patch is None else min(MAX_CURVATURE, max(-MAX_CURVATURE, patch.curvature))
        ),
        fresh=touch.fresh,
        friction=touch.who.friction,
        x_free=vec3(contact.point) if patch is None else patch.x_free,
        ledger=NOTHING_CUT if patch is None else patch.ledger,
    )


# Two surfaces may be in flight to a watcher, and must not take more than 256 kB of memory.
MAX_SURFACE_BYTES = 96 * 1024
_COARSER = 4.0  # factor on the displacement unit while an encoded surface is too long

# Smallest visible change of each number of a record, in the order of `_key`: 10 um, 1 mN,
# 1 um/N, 1 N/m, 10 N/(m s), 1 ms, 0.001, 1 %, 0.1 1/m, 10 um, 10 mN, 10 N/m.
_STEPS = np.array(
    [1e-5] * 6
    + [1e-3] * 3
    + [1e-6, 1.0, 1.0, 10.0, 1e-3]
    + [1e-3] * 3
    + [1e-2, 0.1]
    + [1e-5] * 3
    + [1e-2] * 5
    + [10.0]
)


class SceneEncoder:
    """Holds the newest scene, and encodes it on demand.

    Args:
        traversal: Traversal of the mesh at rest, which determines the order of encoded vertices.
        follows_records: Whether the users' records determine the surface, as for a body without
            memory; if not, every scene's surface is compared with the last one.

    Attributes:
        tick: Tick of the newest scene; 0 before the first.
        version: Number of scenes so far that differed from the previous scene.
    """

    def __init__(self, traversal: Traversal, *, follows_records: bool) -> None:
        self.tick = 0
        self.version = 0
        self._traversal = traversal
        self._follows_records = follows_records
        self._now = 0.0
        self._room = NO_LAG
        self._records: Sequence[UserRecord] = ()
        self._surface: Callable[[], Floats] = _nothing
        self._key: tuple[object, ...] = ()
        self._shown: Floats | None = None
        self._frames: dict[bool, bytes] = {}
        self._finest = FINEST

    def see(
        self,
        tick: int,
        now: float,
        records: Sequence[UserRecord],
        surface: Callable[[], Floats],
        room: RoomLag = NO_LAG,
    ) -> None:
        """Replace the newest scene by that of a tick.

        Args:
            tick: Number of the tick.
            now: Time of the tick [s].
            records: Records of all users.
            surface: Function that returns the displacement of all vertices, shape (n, 3) [m];
                called only if needed.
            room: Lag, coupling and stability margin of the room (science 3.8).
        """
        self.tick, self._now, self._records, self._surface = tick, now, records, surface
        self._room = room
        self._frames.clear()
        key = (*_key(records), round(1e3 * room.lag), round(1e3 * room.coupling))
        changed = self.version == 0 or key != self._key
        if not self._follows_records:
            shape = surface()
            moved = self._shown is None or bool(np.abs(shape - self._shown).max() > FINEST)
            changed |= moved
            if changed:
                self._shown = shape
        if changed:
            self.version += 1
            self._key = key

    def frame(self, *, surface: bool) -> bytes:
        """Return the encoded newest scene, with or without the surface.

        Raises:
            LocalProtocolError: A number of the scene is out of the range of the wire format.
        """
        if surface not in self._frames:
            records = b"".join(record.encode() for record in self._records)
            tail = self._tail() if surface else b""
            self._frames[surface] = encode_scene(self.tick, self._now, self._room, records, tail)
        return self._frames[surface]

    def _tail(self) -> bytes:
        shape = self._surface()
        tail = Surface.of(shape, self._finest).encode(self._traversal)
        while len(tail) > MAX_SURFACE_BYTES:
            self._finest *= _COARSER
            tail = Surface.of(shape, self._finest).encode(self._traversal)
        if _COARSER * len(tail) < MAX_SURFACE_BYTES:
            self._finest = max(FINEST, self._finest / _COARSER)
        return tail


def _key(records: Sequence[UserRecord]) -> tuple[object, ...]:
    """Return a hashable key of rounded records; records with equal keys look the same."""
    numbers = [
        (
            *r.probe, *r.foot, *r.force, r.c_ii, r.k_o_coupled, r.k_h, r.integral_gain,
            r.loop_delay, *r.normal, r.presence, r.curvature, *r.x_free, *r.ledger.entries,
            r.ledger.gain_cut,
        )
        for r in records
    ]  # fmt: skip
    table = np.rint(np.array(numbers).reshape(-1, len(_STEPS)) / _STEPS)
    # Adding zero turns -0 into 0: both look the same, but their bytes differ.
    words = [(r.user, r.law, r.geometry, r.fresh, r.friction) for r in records]
    return ((table + 0.0).tobytes(), *words)


def _nothing() -> Floats:
    return np.zeros((0, 3))


class SceneBroadcast:
    """All watchers of a room.

    Args:
        room: Room that is watched.
        model: Name of the body's Green's functions; None if the displacement of the body is not a
            sum of Green's functions.

    Attributes:
        watchers: Watchers at present.
        came: Number of watchers since the start.
        slow: Number of times that a watcher became slow.
        problem: Reason why the newest scene could not be encoded; None if it could.
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
        """Add a watcher, or raise an error if it cannot be shown the body.

        Args:
            watcher: Watcher that has sent its first message.
            to_wall: Time on the wall clock minus time on the server's clock [s].
            grants: Actions that the watcher's token allows.
            session: Token with which the watcher can come back; None if it needs no token.

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
                users=tuple(
                    RoomUser(user=m.user, name=m.hello.name, rules=m.hello.rules) for m in members
                ),
                allow_latency=settings.allow_latency and grants.can_inject_latency,
                allow_fixed_gains=settings.allow_fixed_gains,
                allow_upload=settings.allow_upload,
                can_touch=grants.can_touch,
                room_admin=grants.room_admin,
                can_record=grants.may_record and bool(settings.recordings),
                session=session,
            )
        )

    def leave(self, watcher: Watcher) -> None:
        """Remove a watcher, if it belongs to the scene broadcast."""
        self.watchers.discard(watcher)

    def see(self, world: WorldState, patches: Mapping[int, Patch], now: float) -> None:
        """Make the state after a tick the newest scene; do nothing while nobody watches.

        Args:
            world: State of the simulation after the tick.
            patches: Patches of the tick, by user number.
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
        """Queue the newest scene for a watcher, if the watcher is due to get one.

        Args:
            watcher: Watcher that is shown the scene.
            now: Time [s].
            clear: Whether the operating system has taken all earlier writes to the watcher.
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
        """Return the encoded newest scene; None, with the reason in `problem`, if that fails."""
        try:
            frame = self._encoder.frame(surface=surface)
        except LocalProtocolError as error:
            # For example, the body was pushed out of the coordinate range. Users are not affected.
            self.problem = str(error)
            return None
        self.problem = None
        return frame
