"""Message from server to client, each tick: the surface in front of one user, and gains.

A patch is state, not an event: the newest patch replaces every older one. The patch is the surface
*free of this client's own force* (science 3.3); the surface with that force is
x_o = x_free - c_ii own_force, so that one message serves every law. A mesh patch has a tail, the
neighbourhood (`neighbourhood.py`); outside the neighbourhood the client uses the plane or sphere of
the patch's curvature. Every number has bounds, checked at both ends, so that no accepted patch
makes a client's loop dangerous.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from cohaptic.control.friction import Compliance3, is_definite
from cohaptic.control.law import Law
from cohaptic.control.room_lag import NO_LAG, RoomLag
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
    wrong,
)
from cohaptic.protocol.layout import COMPLIANCE, PATCH
from cohaptic.protocol.neighbourhood import Neighbourhood
from cohaptic.protocol.partners import Partners
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.vec import Vec3, norm

_BODY: Final = PATCH.packer()
SIZE: Final = PATCH.size
_U32: Final = 2**32 - 1
MAX_STIFFNESS: Final = 1e6  # N/m
# Compliance of a contact on fixed or rigid parts. With this value such parts need no special case,
# and the hand feels the stiffness of its device.
MIN_COMPLIANCE: Final = 1.0 / MAX_STIFFNESS  # m/N
MAX_COMPLIANCE: Final = (
    MAX_POSITION  # m/N; a newton moves such a place out of every user's workspace
)
MAX_CURVATURE: Final = 1e4  # 1/m; a radius of a tenth of a millimetre
# s. Sixteen users at one place with 1 s of delay need 13 s; 64 users at one place with 2 s of delay
# would need 114 s. A longer lag is sent as this value, and a margin below 1 then shows that it is
# too short.
MAX_LAG: Final = 60.0
MAX_COUPLING: Final = 1e3  # 63 for 64 users at one place; a larger coupling is sent as this value
# About the largest value in 16 bits. Larger margins are sent as this value; without coupling the
# margin is infinite.
MAX_MARGIN: Final = 6e4
# Relative rounding of 32 bits on the wire, by which c_ii may exceed its limits.
_ROUNDING: Final = 1e-6
MAX_GAIN_CUT: Final = 6e4  # N/m, about the largest value in 16 bits; more is sent as this value
_MAX_CUT: Final = 3.0 * MAX_FORCE  # N; a force and its answers are each bounded by `MAX_FORCE`
_GEOMETRY_MASK: Final = 0x000F
_LAW_SHIFT: Final = 4
_LAW_MASK: Final = 0x000F
_COMPLIANCE_FLAG: Final = 0x0100
_PARTNERS_FLAG: Final = 0x0200
_COMPLIANCE: Final = COMPLIANCE.packer()
LAWS: Final = tuple(Law)  # in the order of their numbers on the wire, from 1


class Geometry(IntEnum):
    """Shape of a patch's local surface, sent in the low four bits of the frame's flags."""

    PLANE = 1
    SPHERE = 2
    MESH = 3


# Indexed by number less 1, and bound once: making a member from its number takes a microsecond, and
# so does looking one up in its class.
_GEOMETRIES: Final = (Geometry.PLANE, Geometry.SPHERE, Geometry.MESH)
_FIRST: Final = int(Geometry.PLANE)
_MESH: Final = int(Geometry.MESH)
_MESH_MEMBER: Final = Geometry.MESH


@dataclass(init=False)
class Patch:
    """One user's local surface, and the parameters of its local model.

    Args:
        tick: Simulation tick that made this patch, from 1.
        seq: Number of the newest contact sample that the body's forces include; 0 for none.
        t_server: Time of the tick on the server's clock [s].
        t_client: `t_client` of sample `seq`, sent back; 0 without a sample [s].
        sample_wait: Time that sample `seq` waited at the server for the tick [s].
        geometry: Shape of the local surface.
        law: Local model that the gains are meant for.
        x_free: Contact point of the surface without this client's own force [m].
        normal: Outward unit normal at the contact point.
        curvature: Curvature of a sphere or mesh patch, positive for a body bulging towards the hand
            [1/m].
        c_ii: Compliance of the contact [m/N].
        k_h: Gain that the server chose for the client's law [N/m].
        integral_gain: I of the law's integral; 0 when unused [N/(m s)].
        own_force: Force on this hand whose opposite the body carries at this tick [N].
        u_others: Displacement of the material under the contact caused by the other users [m].
        room: Lag, coupling and margin of the room (science 3.8).
        neighbourhood: Surface around the contact in a mesh patch; None in a plane or sphere patch.
        compliance: Compliance of the contact in all directions, for a client with friction; None
            for a client without friction.
        partners: The other hands, for a client that moves models of them; None for other clients.
        ledger: What the tick made of this client's force.
    """

    tick: Final[int]
    seq: Final[int]
    t_server: Final[float]
    t_client: Final[float]
    sample_wait: Final[float]
    geometry: Final[Geometry]
    law: Final[Law]
    x_free: Final[Vec3]
    normal: Final[Vec3]
    curvature: Final[float]
    c_ii: Final[float]
    k_h: Final[float]
    integral_gain: Final[float]
    own_force: Final[Vec3]
    u_others: Final[Vec3]
    room: Final[RoomLag]
    neighbourhood: Final[Neighbourhood | None]
    compliance: Final[Compliance3 | None]
    partners: Final[Partners | None]
    ledger: Final[TickLedger]

    def __init__(
        self,
        tick: int,
        seq: int,
        t_server: float,
        t_client: float,
        sample_wait: float,
        geometry: Geometry,
        law: Law,
        x_free: Vec3,
        normal: Vec3,
        curvature: float,
        c_ii: float,
        k_h: float,
        integral_gain: float,
        own_force: Vec3,
        u_others: Vec3,
        room: RoomLag = NO_LAG,
        neighbourhood: Neighbourhood | None = None,
        compliance: Compliance3 | None = None,
        partners: Partners | None = None,
        ledger: TickLedger = NOTHING_CUT,
    ) -> None:
        self.tick = tick
        self.seq = seq
        self.t_server = t_server
        self.t_client = t_client
        self.sample_wait = sample_wait
        self.geometry = geometry
        self.law = law
        self.x_free = x_free
        self.normal = normal
        self.curvature = curvature
        self.c_ii = c_ii
        self.k_h = k_h
        self.integral_gain = integral_gain
        self.own_force = own_force
        self.u_others = u_others
        self.room = room
        self.neighbourhood = neighbourhood
        self.compliance = compliance
        self.partners = partners
        self.ledger = ledger

    @property
    def k_o(self) -> float:
        """Stiffness of the body at this contact alone, 1 / c_ii [N/m]."""
        return 1.0 / self.c_ii

    def encode(self) -> bytes:
        """The frame of this patch; raises LocalProtocolError when a value is out of its limits."""
        self.check(remote=False)
        flags = int(self.geometry) | (LAWS.index(self.law) + 1) << _LAW_SHIFT
        tail = b""
        if self.compliance is not None:
            flags |= _COMPLIANCE_FLAG
            tail = _COMPLIANCE.pack(*self.compliance)
        if self.partners is not None:
            flags |= _PARTNERS_FLAG
            tail += self.partners.encode()
        if self.neighbourhood is not None:
            tail += self.neighbourhood.encode()
        body = _BODY.pack(
            self.tick,
            self.seq,
            self.t_server,
            self.t_client,
            self.sample_wait,
            *self.x_free,
            *self.normal,
            self.curvature,
            self.c_ii,
            self.k_h,
            self.integral_gain,
            *self.own_force,
            *self.u_others,
            self.room.lag,
            self.room.coupling,
            min(self.room.margin, MAX_MARGIN),
            *self.ledger.entries,
            min(self.ledger.gain_cut, MAX_GAIN_CUT),
        )
        return HEADER.pack(PROTOCOL_VERSION, FrameKind.PATCH, flags) + body + tail

    @classmethod
    def decode(cls, data: bytes) -> Patch:
        """The patch in a frame; raises RemoteProtocolError for any invalid bytes."""
        flags = open_header(data, FrameKind.PATCH)
        kind = flags & _GEOMETRY_MASK
        check_range("geometry of a patch", kind, _FIRST, _MESH, remote=True)
        law = flags >> _LAW_SHIFT & _LAW_MASK
        check_range("law of a patch", law, 1, len(LAWS), remote=True)
        check_range("flags of a patch", flags, 0, 2 * _PARTNERS_FLAG - 1, remote=True)
        mesh, size = kind == _MESH, SIZE
        if flags & _COMPLIANCE_FLAG:
            size += _COMPLIANCE.size
        partners: Partners | None = None
        if flags & _PARTNERS_FLAG and len(data) >= size:
            partners, size = Partners.decode(data, size)
        if len(data) < size or (len(data) > size and not mesh):
            limit = f"{size} bytes" + (" and a neighbourhood" if mesh else "")
            raise RemoteProtocolError("patch length", len(data), limit)
        neighbourhood = Neighbourhood.decode(data[size:]) if mesh else None
        patch = cls._unpack(data, flags, neighbourhood, partners)
        patch.check(remote=True)
        return patch

    @classmethod
    def decode_checked(cls, data: bytes) -> Patch:
        """The patch in a frame that `decode` has accepted before; the values are not checked."""
        flags = int(HEADER.unpack_from(data)[2])
        neighbourhood, partners = None, None
        size = SIZE + _COMPLIANCE.size if flags & _COMPLIANCE_FLAG else SIZE
        if flags & _PARTNERS_FLAG:
            partners, size = Partners.decode(data, size)
        if flags & _GEOMETRY_MASK == _MESH:
            neighbourhood = Neighbourhood.decode_checked(data[size:])
        return cls._unpack(data, flags, neighbourhood, partners)

    @classmethod
    def _unpack(
        cls,
        data: bytes,
        flags: int,
        neighbourhood: Neighbourhood | None,
        partners: Partners | None,
    ) -> Patch:
        """The patch in a frame with these flags; the values are not checked."""
        compliance = None
        if flags & _COMPLIANCE_FLAG:
            compliance = Compliance3(*_COMPLIANCE.unpack_from(data, SIZE))
        tick, seq, t_server, t_client, wait, *v = _BODY.unpack_from(data, HEADER.size)
        return cls(
            tick, seq, t_server, t_client, wait, _GEOMETRIES[(flags & _GEOMETRY_MASK) - 1],
            LAWS[(flags >> _LAW_SHIFT & _LAW_MASK) - 1],
            (v[0], v[1], v[2]), (v[3], v[4], v[5]), v[6], v[7], v[8], v[9],
            (v[10], v[11], v[12]), (v[13], v[14], v[15]), RoomLag(v[16], v[17], v[18]),
            neighbourhood, compliance, partners,
            TickLedger(v[19], v[20], v[21], v[22], v[23], v[24]),
        )  # fmt: skip

    def check(self, *, remote: bool) -> None:
        """Raise unless every value is in its limits; the neighbourhood has a check of its own.

        Args:
            remote: Whether the peer made the patch.
        """
        if (self.geometry is _MESH_MEMBER) != (self.neighbourhood is not None):
            name, limit = f"neighbourhood of a {self.geometry.name.lower()} patch", "one of a mesh"
            raise wrong(name, self.neighbourhood, limit, remote=remote)
        check_range("tick of a patch", self.tick, 1, _U32, remote=remote)
        check_range("seq of a patch", self.seq, 0, _U32, remote=remote)
        check_finite("time stamp", self.t_server, self.t_client, remote=remote)
        check_range("sample_wait", self.sample_wait, 0.0, 1e6, remote=remote)
        check_vector("x_free", self.x_free, MAX_POSITION, "m", remote=remote)
        check_finite("normal", *self.normal, remote=remote)
        check_range("length of normal", norm(self.normal), 0.999, 1.001, remote=remote)
        check_range("curvature", self.curvature, -MAX_CURVATURE, MAX_CURVATURE, remote=remote)
        least = MIN_COMPLIANCE * (1.0 - _ROUNDING)
        largest = MAX_COMPLIANCE * (1.0 + _ROUNDING)
        check_range("c_ii", self.c_ii, least, largest, remote=remote)
        check_range("k_h", self.k_h, 0.0, MAX_STIFFNESS, remote=remote)
        check_range("integral_gain", self.integral_gain, 0.0, 1e9, remote=remote)
        check_vector("own_force", self.own_force, MAX_FORCE, "N", remote=remote)
        check_vector("u_others", self.u_others, MAX_POSITION, "m", remote=remote)
        check_room(self.room, remote=remote)
        check_ledger(self.ledger, remote=remote)
        if self.partners is not None:
            self.partners.check(remote=remote)
        for value in self.compliance or ():
            check_range("compliance", value, -MAX_POSITION, MAX_POSITION, remote=remote)
        if self.compliance is not None and not is_definite(self.compliance):
            raise wrong("compliance", tuple(self.compliance), "positive definite", remote=remote)


def check_room(room: RoomLag, *, remote: bool) -> None:
    """Raise unless lag, coupling and margin of a room are in their limits; NaN raises too."""
    check_range("lag of the room", room.lag, 0.0, MAX_LAG, remote=remote)
    check_range("coupling of the room", room.coupling, 0.0, MAX_COUPLING, remote=remote)
    check_range("margin of the room", room.margin, 0.0, math.inf, remote=remote)


def check_ledger(ledger: TickLedger, *, remote: bool) -> None:
    """Raise unless each entry of a tick's ledger is in its limits; NaN raises too."""
    for newtons in ledger.entries:
        check_range("entry of a tick's ledger", newtons, -_MAX_CUT, _MAX_CUT, remote=remote)
    # Before it is packed, it may be more than 16 bits hold.
    largest = MAX_GAIN_CUT if remote else MAX_STIFFNESS
    check_range("gain_cut", ledger.gain_cut, 0.0, largest, remote=remote)
