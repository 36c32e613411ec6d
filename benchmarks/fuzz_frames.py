"""Frames of `fuzz.py`: random and mutated ones, from a seed, and those of one who presses."""

from __future__ import annotations

import contextlib
import random
import struct

from cohaptic.control.law import Law
from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.control.company import Aim, Follow, Point, Present
from cohaptic.protocol.messages import Hello, SetLaw, encode_control
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import Moderate, SetLatency, SetView, Watch
from cohaptic.protocol.websocket_frames import make_frame
from cohaptic.vec import norm
from core_users import RADIUS

KEY = b"abcd"  # that frames are masked with
AT_LIMITS = (
    b"\x00" * 4, b"\xff" * 4, struct.pack("<f", float("nan")), struct.pack("<f", float("inf")),
    struct.pack("<f", -3e38), struct.pack("<d", float("nan")), struct.pack("<I", 2**31),
)  # fmt: skip
ELSEWHERE = 1.0  # m from the middle of the body, of a hand that is no neighbour
FAR = (0.0, 3.0, 0.0)  # m; a mutated sample that is still valid is nobody's neighbour


def pressing(seq: int) -> bytes:
    """A sample of one who presses."""
    return ContactSample(seq, 0, 0.0, (RADIUS - 0.01, 0.0, 0.0), (2.0, 0.0, 0.0)).encode()


class Fuzzer:
    """Makes frames from a seed."""

    def __init__(self, seed: int) -> None:
        self._draw = random.Random(seed)
        self._number = 0
        sample = ContactSample(1, 1, 0.0, FAR, (0.0, 0.0, 0.0)).encode()
        texts = [
            encode_control(message)
            for message in (
                Hello(protocol=PROTOCOL_VERSION, name="f"),
                Watch(protocol=PROTOCOL_VERSION, company=True),
                Present(name="f", user=1, key="0123456789abcdef", open=True),
                Follow(user=1),
                Aim(azimuth=1.0, elevation=0.25, distance=4.0),
                Point(point=(0.0, 0.0, 0.1)),
                SetLaw(law=Law.PI),
                SetView(encoding="frames", rate=5.0),
                SetLatency(user=1, delay=0.1),
                Moderate(action="kick", user=1),
            )
        ]
        self._seeds = [sample, sample, Ack(1).encode(), *(text.encode() for text in texts)]

    def hello(self) -> str:
        """A valid first message, of one who touches or one who watches."""
        self._number += 1
        said: Hello | Watch = Hello(protocol=PROTOCOL_VERSION, name=f"f{self._number}")
        if self._draw.random() < 0.3:
            company = self._draw.random() < 0.7
            said = Watch(protocol=PROTOCOL_VERSION, encoding="forces", company=company)
        return encode_control(said)

    def message(self) -> str | bytes:
        """One message, as it comes out of a websocket."""
        draw = self._draw
        data = self._mutated() if draw.random() < 0.85 else draw.randbytes(draw.randrange(200))
        if data[:1] == b"{" or draw.random() < 0.05:
            return data.decode(errors="replace")
        with contextlib.suppress(RemoteProtocolError):
            sample = ContactSample.decode(data)
            if any(sample.force) or norm(sample.probe) < ELSEWHERE:
                return b""
        return data

    def frame(self) -> bytes:
        """One frame as it goes over the wire, some of them broken."""
        draw = self._draw
        whole = make_frame(self.message(), KEY)
        if draw.random() < 0.3:
            at = draw.randrange(min(6, len(whole)))
            whole = whole[:at] + draw.randbytes(1) + whole[at + 1 :]
        return whole

    def _mutated(self) -> bytes:
        draw = self._draw
        data = bytearray(draw.choice(self._seeds))
        for _ in range(draw.randrange(1, 4)):
            at, kind = draw.randrange(len(data) or 1), draw.randrange(5)
            if kind == 0 and data:
                data[at] ^= 1 << draw.randrange(8)
            elif kind == 1:
                del data[at : at + draw.randrange(1, 9)]
            elif kind == 2:
                data[at:at] = draw.randbytes(draw.randrange(1, 9))
            elif kind == 3:
                limit = draw.choice(AT_LIMITS)
                data[at : at + len(limit)] = limit
            else:
                data += data[at:]
        return bytes(data[:3000])
