"""All users of a scene, without the surface: what a client needs that has no mesh of the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

from cohaptic.control.law import Law
from cohaptic.control.room_lag import RoomLag
from cohaptic.control.tick_ledger import NOTHING_CUT, TickLedger
from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import (
    HEADER,
    MAX_FORCE,
    MAX_POSITION,
    check_finite,
    check_range,
    check_vector,
    open_header,
)
from cohaptic.protocol.layout import SCENE, USER
from cohaptic.protocol.patch import (
    LAWS,
    MAX_GAIN_CUT,
    MAX_STIFFNESS,
    Geometry,
    check_ledger,
    check_room,
)
from cohaptic.vec import Vec3, add, norm, sub

SCENE_BODY: Final = SCENE.packer()
_USER = USER.packer()
HEAD_SIZE = SCENE.size
USER_SIZE = USER.size
MAX_USERS = 256  # more than the largest room holds, since forces of users who left fade slowly
MAX_CURVATURE = 6e4  # 1/m, about the largest half float
MAX_LOOP_DELAY = 1e3  # s
SURFACE_FLAG: Final = 0x0001
_FRESH, _FRICTION = 0x01, 0x02
_UNIT = 32767
_U32 = 2**32 - 1


@dataclass(frozen=True, slots=True)
class UserRecord:
    """State of one user at one tick, for watchers.

    Args:
        user: Number of the user.
        probe: Tip of the user's device [m].
        foot: Centre of the user's pressure on the facets of the *resting* mesh [m].
        force: Force on the hand; the body gets the opposite force [N]. The force fades when the
            user leaves.
        c_ii: Compliance of the contact, to 0.05 % [m/N]. This and the next three fields are 0 for
            a user who has left.
        k_o_coupled: Coupling-aware stiffness [N/m].
        k_h: Gain of the user's law [N/m].
        integral_gain: Integral gain of the user's law; 0 for none [N/(m s)].
        loop_delay: Measured delay of the user's loop; 0 before the first measurement [s].
        normal: Outward unit normal of the free surface at the contact.
        law: Local model that the user's client runs.
        geometry: Geometry of the user's patches.
        presence: Share of the user's force that the body carries, from 0 to 1.
        curvature: Curvature of the user's patch, positive where the body bulges [1/m].
        fresh: Whether the user's samples still arrive.
        friction: Whether the user's force may have a part along the surface.
        x_free: Contact point of the surface without this user's own force, to 0.05 % of its
            distance from the tip [m].
        ledger: What the tick made of the user's force.
    """

    user: int
    probe: Vec3
    foot: Vec3
    force: Vec3
    c_ii: float
    k_o_coupled: float
    k_h: float
    integral_gain: float
    loop_delay: float
    normal: Vec3
    law: Law
    geometry: Geometry
    presence: float
    curvature: float
    fresh: bool
    friction: bool
    x_free: Vec3
    ledger: TickLedger = NOTHING_CUT

    def encode(self) -> bytes:
        """The bytes of this user; raises LocalProtocolError when a value is out of its limits."""
        self._check(remote=False)
        x, y, z = self.normal
        return _USER.pack(
            self.user, *self.probe, *self.foot, *self.force,
            self.c_ii, self.k_o_coupled, self.k_h, self.integral_gain, self.loop_delay,
            round(_UNIT * x), round(_UNIT * y), round(_UNIT * z),
            (LAWS.index(self.law) + 1) << 4 | self.geometry, round(255 * self.presence),
            self.curvature, _FRESH * self.fresh | _FRICTION * self.friction,
            *sub(self.x_free, self.probe),
            *self.ledger.entries, min(self.ledger.gain_cut, MAX_GAIN_CUT),
        )  # fmt: skip

    @classmethod
    def decode(cls, data: bytes, offset: int) -> UserRecord:
        """The user whose bytes begin at `offset`; raises RemoteProtocolError for invalid bytes."""
        user, *v = _USER.unpack_from(data, offset)
        shape, state = int(v[17]), int(v[20])
        law, geometry = shape >> 4, shape & 0x0F
        check_range("law of a user", law, 1, len(LAWS), remote=True)
        check_range("geometry of a user", geometry, 1, len(Geometry), remote=True)
        check_range("state of a user", state, 0, _FRESH | _FRICTION, remote=True)
        record = cls(
            user, (v[0], v[1], v[2]), (v[3], v[4], v[5]), (v[6], v[7], v[8]),
            v[9], v[10], v[11], v[12], v[13], (v[14] / _UNIT, v[15] / _UNIT, v[16] / _UNIT),
            LAWS[law - 1], Geometry(geometry), v[18] / 255, v[19],
            bool(state & _FRESH), bool(state & _FRICTION),
            add((v[0], v[1], v[2]), (v[21], v[22], v[23])),
            TickLedger(v[24], v[25], v[26], v[27], v[28], v[29]),
        )  # fmt: skip
        record._check(remote=True)
        return record

    def _check(self, *, remote: bool) -> None:
        check_range("number of a user", self.user, 1, _U32, remote=remote)
        check_vector("probe", self.probe, MAX_POSITION, "m", remote=remote)
        check_vector("foot", self.foot, MAX_POSITION, "m", remote=remote)
        check_vector("force", self.force, 3.0 * MAX_FORCE, "N", remote=remote)
        check_range("c_ii", self.c_ii, 0.0, MAX_POSITION, remote=remote)
        for name in ("k_o_coupled", "k_h"):
            check_range(name, getattr(self, name), 0.0, MAX_STIFFNESS, remote=remote)
        check_range("integral_gain", self.integral_gain, 0.0, 1e9, remote=remote)
        check_range("loop_delay", self.loop_delay, 0.0, MAX_LOOP_DELAY, remote=remote)
        check_finite("normal", *self.normal, remote=remote)
        check_range("length of normal", norm(self.normal), 0.999, 1.001, remote=remote)
        check_range("presence", self.presence, 0.0, 1.0, remote=remote)
        check_range("curvature", self.curvature, -MAX_CURVATURE, MAX_CURVATURE, remote=remote)
        check_vector("x_free", self.x_free, MAX_POSITION, "m", remote=remote)
        check_ledger(self.ledger, remote=remote)


class SceneUsers(NamedTuple):
    """All users at one tick.

    Fields:
        tick: Simulation tick, from 1.
        t_server: Time of the tick on the server's clock [s].
        users: All users in the room, and users who left but whose force still fades.
        room: Lag, coupling and margin of the room (science 3.8).
        end: Number of bytes before the surface; 0 if the frame has none.
    """

    tick: int
    t_server: float
    users: tuple[UserRecord, ...]
    room: RoomLag
    end: int


def decode_users(data: bytes) -> SceneUsers:
    """The users in a scene frame, whether it has a surface or not.

    Raises:
        RemoteProtocolError: The bytes are invalid.
    """
    flags = open_header(data, FrameKind.SCENE)
    check_range("flags of a scene", flags, 0, SURFACE_FLAG, remote=True)
    if len(data) < HEAD_SIZE:
        raise RemoteProtocolError("scene length", len(data), f"at least {HEAD_SIZE} bytes")
    tick, t_server, users, *times = SCENE_BODY.unpack_from(data, HEADER.size)
    room = RoomLag(*times)
    check_head(tick, t_server, users, room, remote=True)
    end = HEAD_SIZE + users * USER_SIZE
    if len(data) < end or (len(data) > end and not flags & SURFACE_FLAG):
        limit = f"{end} bytes" + (" and a surface" if flags & SURFACE_FLAG else "")
        raise RemoteProtocolError("scene length", len(data), limit)
    records = tuple(UserRecord.decode(data, at) for at in range(HEAD_SIZE, end, USER_SIZE))
    return SceneUsers(tick, t_server, records, room, end if flags & SURFACE_FLAG else 0)


def check_head(tick: int, t_server: float, users: int, room: RoomLag, *, remote: bool) -> None:
    """Check the head of a scene; `remote` decides which error a wrong value raises."""
    check_range("tick of a scene", tick, 1, _U32, remote=remote)
    check_finite("time stamp", t_server, remote=remote)
    check_range("users of a scene", users, 0, MAX_USERS, remote=remote)
    check_room(room, remote=remote)
