"""Many users on one core: raw sockets that speak just enough of the protocol.

The users cost as little as they can, so that the machine is the server's. Each sends a sample a
period, at a time of its own within the period, and reads what comes.
"""

from __future__ import annotations

import base64
import contextlib
import math
import os
import select
import socket
import struct
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection as Pipe
from typing import Literal
from urllib.parse import urlsplit

from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.messages import Bye, GeometryName, Hello, encode_control
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.vec import Vec3, scale

PERIOD = 1.0 / 60.0  # s
RADIUS, DEPTH = 0.1, 0.004  # m, of the balloon and of a press
Motion = Literal["press", "slide"]
_PATIENCE = 20.0  # s for one call of a socket
_STUCK = 2.0  # s for a later one: all users of a process wait for one whom the server does not read
_LEAVING = 0.2  # s for the last word to one who does not read


@dataclass
class Count:
    """What came to all users: patches, and bytes of them."""

    patches: int = 0
    size: int = 0

    def add(self, came: bytes, at: int, length: int) -> None:
        """Count a patch: bytes `at` to `at + length` of `came`."""
        del came, at
        self.patches += 1
        self.size += length


def crowd(pipe: Pipe) -> None:
    """Main function of the process: play each scene that the pipe orders, until it ends.

    A scene is the arguments of `play`. While it lasts, `True` is answered by patches and bytes so
    far, and `False` ends it.
    """
    while True:
        try:
            play(pipe, *pipe.recv())
        except EOFError:
            return


def play(
    pipe: Pipe, url: str, users: int, geometry: GeometryName, motion: Motion, speed: float
) -> None:
    """Play one scene.

    Args:
        pipe: To whoever measures.
        url: URL of the server, or of a room of it; a bare one has a number for a path.
        users: How many, evenly round the equator.
        geometry: Geometry of the patches asked for.
        motion: What everybody does, all the time.
        speed: Speed of sliding [m/s].
    """
    count = Count()
    everybody = [
        User(url, geometry, motion, speed, 2.0 * math.pi * i / users, i) for i in range(users)
    ]
    poll = select.poll()
    by_file = {user.socket.fileno(): user for user in everybody}
    for file in (*by_file, pipe.fileno()):
        poll.register(file, select.POLLIN)
    start, sent = time.perf_counter() + PERIOD, 0
    while True:
        due = start + sent * PERIOD / users
        for file, _ in poll.poll(max(0.0, 1e3 * (due - time.perf_counter()))):
            if file != pipe.fileno():
                by_file[file].read(count)
            elif pipe.recv():
                pipe.send((count.patches, count.size))
            else:
                for user in everybody:
                    user.leave()
                return
        now = time.perf_counter()
        while start + sent * PERIOD / users <= now:
            everybody[sent % users].write(now - start)
            sent += 1


class User:
    """One connection.

    Args:
        url: As in `play`.
        geometry: Geometry of its patches.
        motion: What it does.
        speed: Speed of sliding [m/s].
        angle: Angle of its place on the equator [rad].
        number: Number of this user.
        patience: For the server to answer [s].
    """

    def __init__(
        self,
        url: str,
        geometry: GeometryName,
        motion: Motion,
        speed: float,
        angle: float,
        number: int,
        patience: float = _PATIENCE,
    ) -> None:
        self._angle, self._turn = angle, speed / RADIUS if motion == "slide" else 0.0
        self._seq = self._tick = 0
        self._came = self._farewell = b""
        parts = urlsplit(url)
        # Nobody waits for ever for a server that has stopped reading, or never answers.
        self.socket = socket.create_connection((parts.hostname, parts.port), patience)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [f"GET {parts.path or '/'} HTTP/1.1", f"Host: {parts.netloc}"]
        lines += ["Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}"]
        lines += ["Sec-WebSocket-Version: 13", f"Sec-WebSocket-Protocol: {SUBPROTOCOL}"]
        self.socket.sendall("\r\n".join([*lines, "", ""]).encode())
        while b"\r\n\r\n" not in self._came:
            came = self.socket.recv(4096)
            if not came:
                raise ConnectionResetError("closed before its answer")
            self._came += came
        self.socket.settimeout(_STUCK)
        head, _, self._came = self._came.partition(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 101"), head
        self._ours = not parts.path[1:].isdigit()
        if self._ours:
            name = (
                f"u{number}-{os.urandom(4).hex()}"  # those of the last scene may still be leaving
            )
            hello = Hello(protocol=PROTOCOL_VERSION, name=name, geometry=geometry)
            self._send(0x81, encode_control(hello).encode())

    def write(self, t: float) -> None:
        """Send a sample of the time `t` [s]."""
        angle = self._angle + self._turn * t
        out: Vec3 = (math.cos(angle), math.sin(angle), 0.0)
        level = 0.5 - 0.5 * math.cos(math.pi * t + self._angle)
        self._seq += 1
        probe, force = scale(out, RADIUS - DEPTH * (0.5 + 0.5 * level)), scale(out, 0.5 + level)
        self._send(0x82, ContactSample(self._seq, self._tick, t, probe, force).encode())

    def read(self, count: Count) -> None:
        """Take what has come, and count the patches; raises OSError once the server has closed."""
        new = self.socket.recv(65536)
        if not new:
            raise ConnectionResetError("closed")
        came = self._came + new
        at = 0
        while len(came) >= at + 2:
            length, head = came[at + 1], 2
            if length >= 126:
                head += 2 if length == 126 else 8
                if len(came) < at + head:
                    break
                length = int.from_bytes(came[at + 2 : at + head], "big")
            if len(came) < at + head + length:
                break
            if came[at] == 0x82 and (not self._ours or came[at + head + 1] == FrameKind.PATCH):
                count.add(came, at + head, length)
                if self._ours:
                    (self._tick,) = struct.unpack_from("<I", came, at + head + 4)
            elif came[at] == 0x88:
                self._farewell = came[at + head + 2 : at + head + length]
            elif came[at] == 0x89:
                self._send(0x8A, came[at + head : at + head + length])
            at += head + length
        self._came = came[at:]

    @property
    def last_words(self) -> bytes:
        """Reason with which a peer has closed, or the last bytes that were not understood."""
        with contextlib.suppress(OSError):
            self.socket.setblocking(False)
            self._came += self.socket.recv(4096)
        return self._farewell or self._came[-300:]

    def leave(self) -> None:
        """Go with a word: the seat of one who only vanishes is kept for a while."""
        with contextlib.suppress(OSError):
            self.socket.settimeout(_LEAVING)
            if self._ours:
                self._send(0x81, encode_control(Bye()).encode())
        self.socket.close()

    def _send(self, kind: int, data: bytes) -> None:
        """Send a frame, masked with zeros, which leaves it as it is."""
        length = (
            bytes([0x80 | len(data)]) if len(data) < 126 else b"\xfe" + len(data).to_bytes(2, "big")
        )
        self.socket.sendall(bytes([kind]) + length + bytes(4) + data)
