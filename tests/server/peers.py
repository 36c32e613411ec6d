"""What a client says, for the tests of those who listen."""

from __future__ import annotations

import json

from cohaptic.control.law import Law
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import Hello, encode_control
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.vec import Vec3


def hello(name: str = "left", *, law: Law = Law.PREDICTIVE, max_force: float = 10.0) -> Hello:
    return Hello(protocol=PROTOCOL_VERSION, name=name, law=law, max_force=max_force)


def hello_text(name: str = "left") -> str:
    return encode_control(hello(name))


def sample(
    seq: int = 1, probe: Vec3 = (0.09, 0.0, 0.0), force: Vec3 = (2.0, 0.0, 0.0)
) -> ContactSample:
    """A sample of a hand that presses the right side of the balloon."""
    return ContactSample(seq=seq, tick=0, t_client=0.25 * seq, probe=probe, force=force)


def text(kind: str, **fields: object) -> str:
    """Any control message, also one that no client of ours can make."""
    return json.dumps({"type": kind} | fields)
