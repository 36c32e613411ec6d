"""Server to client, once per simulation tick: the surface in front of one user, and its gains.

State, not an event: the newest replaces every older one. The patch is the surface *free of this
client's own force* (science 3.3); with `c_ii` and `own_force` the surface as it stands follows,
x_o = x_free - c_ii own_force normal, so that one message serves every law.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

from cohaptic.protocol.frame import (
    HEADER,
    MAX_FORCE,
    MAX_POSITION,
    FrameKind,
    check_finite,
    check_range,
    check_vector,
    open_frame,
)
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.vec import Vec3, norm

_BODY = struct.Struct("<IIddf3f3f8f")
SIZE = HEADER.size + _BODY.size
_U32 = 2**32 - 1
MAX_STIFFNESS = 1e6  # N/m
_GEOMETRY_MASK = 0x000F


class Geometry(IntEnum):
    """Shape of the local surface; the low four bits of the frame's flags."""

    PLANE = 1
    SPHERE = 2


@dataclass(frozen=True, slots=True)
class Patch:
    """One user's local surface and what the local model needs to press on it.

    Args:
        tick: Simulation tick that made it, from 1.
        seq: Contact sample whose force this surface already contains; 0 for none.
        t_server: Time of the tick on the server's clock [s].
        t_client: `t_client` of sample `seq`, sent back; 0 without one [s].
        sample_wait: How long sample `seq` waited at the server for the tick [s].
        geometry: Shape of the local surface.
        x_free: Contact point of the surface without this client's own force [m].
        normal: Outward unit normal there.
        curvature: Of a sphere patch, positive for a body bulging towards the hand [1/m].
        k_o: Stiffness of the body at the contact, alone: 1 / c_ii [N/m].
        k_o_coupled: Coupling-aware stiffness, 1 / sum_j |C_ij| (3.2) [N/m].
        c_ii: Compliance of the contact [m/N].
        k_h: Gain that the server chose for the client's law [N/m].
        integral_gain: I of the integral model; 0 when unused [N/(m s)].
        own_force: Normal force of this client that the body carries at this tick [N].
        u_others: Displacement of the contact point by the others, along the normal [m].
    """

    tick: int
    seq: int
    t_server: float
    t_client: float
    sample_wait: float
    geometry: Geometry
    x_free: Vec3
    normal: Vec3
    curvature: float
    k_o: float
    k_o_coupled: float
    c_ii: float
    k_h: float
    integral_gain: float
    own_force: float
    u_others: float

    def encode(self) -> bytes:
        """The frame of this patch; raises LocalProtocolError when a value is out of its limits."""
        self._check(remote=False)
        return HEADER.pack(PROTOCOL_VERSION, FrameKind.PATCH, int(self.geometry)) + _BODY.pack(
            self.tick,
            self.seq,
            self.t_server,
            self.t_client,
            self.sample_wait,
            *self.x_free,
            *self.normal,
            self.curvature,
            self.k_o,
            self.k_o_coupled,
            self.c_ii,
            self.k_h,
            self.integral_gain,
            self.own_force,
            self.u_others,
        )

    @classmethod
    def decode(cls, data: bytes) -> Patch:
        """The patch in a frame; raises RemoteProtocolError, whatever the bytes."""
        flags = open_frame(data, FrameKind.PATCH, SIZE)
        kind = flags & _GEOMETRY_MASK
        check_range("geometry of a patch", kind, Geometry.PLANE, Geometry.SPHERE, remote=True)
        tick, seq, t_server, t_client, wait, *v = _BODY.unpack_from(data, HEADER.size)
        patch = cls(
            tick, seq, t_server, t_client, wait, Geometry(kind),
            (v[0], v[1], v[2]), (v[3], v[4], v[5]), *v[6:14],
        )  # fmt: skip
        patch._check(remote=True)
        return patch

    def _check(self, *, remote: bool) -> None:
        check_range("tick of a patch", self.tick, 1, _U32, remote=remote)
        check_range("seq of a patch", self.seq, 0, _U32, remote=remote)
        check_finite("time stamp", self.t_server, self.t_client, self.curvature, remote=remote)
        check_range("sample_wait", self.sample_wait, 0.0, 1e6, remote=remote)
        check_vector("x_free", self.x_free, MAX_POSITION, "m", remote=remote)
        check_finite("normal", *self.normal, remote=remote)
        check_range("length of normal", norm(self.normal), 0.999, 1.001, remote=remote)
        for name in ("k_o", "k_o_coupled", "k_h"):
            check_range(name, getattr(self, name), 0.0, MAX_STIFFNESS, remote=remote)
        check_range("c_ii", self.c_ii, 0.0, MAX_POSITION, remote=remote)
        check_range("integral_gain", self.integral_gain, 0.0, 1e9, remote=remote)
        check_range("own_force", self.own_force, 0.0, MAX_FORCE, remote=remote)
        check_range("u_others", self.u_others, -MAX_POSITION, MAX_POSITION, remote=remote)
