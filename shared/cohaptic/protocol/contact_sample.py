"""Message from client to server, each simulation period: tip position and force on the hand.

A sample is state, not an event: the newest sample replaces every older one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cohaptic.control.hand_model import HandModel
from cohaptic.errors import LocalProtocolError, RemoteProtocolError
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import (
    HEADER,
    MAX_FORCE,
    MAX_POSITION,
    check_finite,
    check_range,
    check_vector,
    open_frame,
    open_header,
)
from cohaptic.protocol.layout import ANCHOR, CONTACT_SAMPLE, DEFLECTION, OWN_MODEL
from cohaptic.protocol.partners import check_model, is_allowed
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.vec import Vec3, norm

_BODY = CONTACT_SAMPLE.packer()
_ANCHOR = ANCHOR.packer()
_DEFLECTION = DEFLECTION.packer()
SIZE = CONTACT_SAMPLE.size
_MODEL = OWN_MODEL.packer()
ANCHORED, GIVING, KNOWN = (
    1,
    2,
    4,
)  # flags: an anchor follows; a deflection does; the hand's model does
# By the flags.
SIZES = {
    flags: SIZE
    + (flags & ANCHORED) * ANCHOR.size
    + (flags // GIVING % 2) * DEFLECTION.size
    + (flags // KNOWN) * OWN_MODEL.size
    for flags in (0, 1, 2, 3, 6, 7)
}
_PLAIN_HEAD = HEADER.pack(PROTOCOL_VERSION, FrameKind.CONTACT_SAMPLE, 0)
_U32 = 2**32 - 1


class ContactSample(NamedTuple):
    """The force last given to the device (section 6, step 3), and the tip's position at that time.

    Fields:
        seq: Counts this client's samples from 1.
        tick: Tick of the newest patch that the client has used; 0 for none.
        t_client: Time of the sample on the client's clock [s].
        probe: Tip of the device in the world frame [m].
        force: Force on the hand in the world frame [N]; the body gets the opposite force.
        anchor: Point of the resting surface that the finger holds by friction, wherever forces
            have moved that point since [m]; None without friction or contact.
        deflection: Displacement of the model of the hand [m]; None if the client has no such model.
        own_model: The hand itself, of a client that simulates it; only with a deflection.
    """

    seq: int
    tick: int
    t_client: float
    probe: Vec3
    force: Vec3
    anchor: Vec3 | None = None
    deflection: float | None = None
    own_model: HandModel | None = None

    def encode(self) -> bytes:
        """The frame of this sample; raises LocalProtocolError when a value is out of its limits."""
        self._check(remote=False)
        body = _BODY.pack(self.seq, self.tick, self.t_client, *self.probe, *self.force)
        if self.anchor is None and self.deflection is None:
            return _PLAIN_HEAD + body
        flags = 0
        if self.anchor is not None:
            flags, body = flags | ANCHORED, body + _ANCHOR.pack(*self.anchor)
        if self.deflection is not None:
            flags, body = flags | GIVING, body + _DEFLECTION.pack(self.deflection)
            if self.own_model is not None:
                flags, body = flags | KNOWN, body + _MODEL.pack(*self.own_model)
        return HEADER.pack(PROTOCOL_VERSION, FrameKind.CONTACT_SAMPLE, flags) + body

    @classmethod
    def decode(cls, data: bytes) -> ContactSample:
        """The sample in a frame; raises RemoteProtocolError for any invalid bytes."""
        anchor: Vec3 | None = None
        deflection: float | None = None
        model: HandModel | None = None
        if len(data) != SIZE or data[:4] != _PLAIN_HEAD:
            flags = open_header(data, FrameKind.CONTACT_SAMPLE)
            if flags not in SIZES:
                raise RemoteProtocolError("flags of a contact sample", flags, "0 to 3, 6 or 7")
            open_frame(data, FrameKind.CONTACT_SAMPLE, SIZES[flags])
            if flags & ANCHORED:
                x, y, z = _ANCHOR.unpack_from(data, SIZE)
                anchor = (x, y, z)
            if flags & GIVING:
                (deflection,) = _DEFLECTION.unpack_from(data, SIZES[flags & ANCHORED])
            if flags & KNOWN:
                model = HandModel(*_MODEL.unpack_from(data, SIZES[flags & ~KNOWN]))
        seq, tick, t, x, y, z, f_x, f_y, f_z = _BODY.unpack_from(data, HEADER.size)
        sample = cls(seq, tick, t, (x, y, z), (f_x, f_y, f_z), anchor, deflection, model)
        # The server decodes a sample of each user at each tick. One condition tests all limits of
        # `_check` that bytes can break; only if it fails does `_check` find which limit is broken.
        if not (
            seq
            and math.isfinite(t)
            and norm(sample.probe) <= MAX_POSITION
            and norm(sample.force) <= MAX_FORCE
            and (anchor is None or norm(anchor) <= MAX_POSITION)
            and (deflection is None or abs(deflection) <= MAX_POSITION)
            and (model is None or is_allowed(model))
        ):
            sample._check(remote=True)
        return sample

    def _check(self, *, remote: bool) -> None:
        check_range("seq of a contact sample", self.seq, 1, _U32, remote=remote)
        check_range("tick of a contact sample", self.tick, 0, _U32, remote=remote)
        check_finite("t_client", self.t_client, remote=remote)
        check_vector("probe", self.probe, MAX_POSITION, "m", remote=remote)
        check_vector("force", self.force, MAX_FORCE, "N", remote=remote)
        if self.anchor is not None:
            check_vector("anchor", self.anchor, MAX_POSITION, "m", remote=remote)
        if self.deflection is not None:
            check_range("deflection", self.deflection, -MAX_POSITION, MAX_POSITION, remote=remote)
        if self.own_model is not None:
            check_model(self.own_model, remote=remote)
            if self.deflection is None:  # bytes cannot have the one without the other
                raise LocalProtocolError("deflection beside a model", None, "a number")
