"""Client to server, once per simulation period: position of the tip, and force on the hand.

State, not an event: the newest replaces every older one.
"""

from __future__ import annotations

import math
import struct
from typing import NamedTuple

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

_BODY = struct.Struct("<IIdffffff")
SIZE = HEADER.size + _BODY.size
_KIND = int(FrameKind.CONTACT_SAMPLE)
_U32 = 2**32 - 1


class ContactSample(NamedTuple):
    """The last force given to the device (section 6, step 3), and the tip's position then.

    Fields:
        seq: Counts this client's samples from 1.
        tick: Tick of the newest patch that the client has used; 0 for none.
        t_client: When the sample was taken, on the client's clock [s].
        probe: Tip of the device in the world frame [m].
        force: On the hand in the world frame [N]; the body gets its opposite.
    """

    seq: int
    tick: int
    t_client: float
    probe: Vec3
    force: Vec3

    def encode(self) -> bytes:
        """The frame of this sample; raises LocalProtocolError when a value is out of its limits."""
        self._check(remote=False)
        head = HEADER.pack(PROTOCOL_VERSION, FrameKind.CONTACT_SAMPLE, 0)
        return head + _BODY.pack(self.seq, self.tick, self.t_client, *self.probe, *self.force)

    @classmethod
    def decode(cls, data: bytes) -> ContactSample:
        """The sample in a frame; raises RemoteProtocolError for any invalid bytes."""
        if len(data) != SIZE or data[0] != PROTOCOL_VERSION or data[1] != _KIND:
            open_frame(data, FrameKind.CONTACT_SAMPLE, SIZE)
        seq, tick, t, x, y, z, f_x, f_y, f_z = _BODY.unpack_from(data, HEADER.size)
        sample = cls(seq, tick, t, (x, y, z), (f_x, f_y, f_z))
        # A server does this for each user at each tick: the limits of `_check` that bytes can
        # break, at once; which one it is, is found only where one is broken.
        if not (
            seq
            and math.isfinite(t)
            and norm(sample.probe) <= MAX_POSITION
            and norm(sample.force) <= MAX_FORCE
        ):
            sample._check(remote=True)
        return sample

    def _check(self, *, remote: bool) -> None:
        check_range("seq of a contact sample", self.seq, 1, _U32, remote=remote)
        check_range("tick of a contact sample", self.tick, 0, _U32, remote=remote)
        check_finite("t_client", self.t_client, remote=remote)
        check_vector("probe", self.probe, MAX_POSITION, "m", remote=remote)
        check_vector("force", self.force, MAX_FORCE, "N", remote=remote)
