"""A million random and mutated frames at a room, and thousands of connections at a server.

    python benchmarks/fuzz.py [--frames 1000000] [--connections 4000] [--seed 1] [--json FILE]

Frames are random bytes, and samples, acks and control messages with bytes changed, cut out, put in
or doubled, or numbers replaced by ones at the limits of their types. A server closes who breaks a
rule and does not look at what else it has sent, so most of them are given to the lobby of a room
without a socket, where each is decoded: by users and watchers who have said a good hello, and by
some who have not. Who is closed is followed by another. Beside it is a room with nobody but the
victim, who presses in both; their patches have to be equal in every number. Frames that are valid
samples of a force, or of a hand near the body, are left out: to be there is nobody's fault. Then
connections come to a server process from another address, each with a few such frames, some of
them broken websocket frames, and a victim presses there. It ends with status 1 on any exception, a
difference, a traceback in the log, or if memory grows by more than 5 % after the first quarter.
"""

from __future__ import annotations

import contextlib
import os
import random
import socket
import struct
import sys
import tempfile
import threading
import time
from pathlib import Path

from websockets.sync.client import connect
from websockets.typing import Subprotocol

import json_report
from cohaptic.control.law import Law
from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import Hello, SetLaw, encode_control
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import Moderate, SetLatency, SetView, Watch
from cohaptic.protocol.websocket_frames import make_frame
from cohaptic.vec import norm
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.demo.processes import Process
from cohaptic_server.guard.budget import Budget
from cohaptic_server.guard.limits import Limits
from cohaptic_server.guard.sources import Sources
from cohaptic_server.room.entrance import Entrance
from cohaptic_server.room.lobby import Lobby
from cohaptic_server.room.peer import Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.watch.audience import Audience
from cohaptic_server.settings import ServerSettings
from core_users import PERIOD, RADIUS
from soak import resident

HOSTILE = "127.0.0.9"
KEY = b"abcd"
GROWTH = 0.05
FRAMES_A_TICK = 50
STILL = 1e-3  # N; others who come and go may choose another lag for the room
FREE = ("open=2000", "open_in_all=4000", "connections=100000:100000", "joins=100000:100000")
AT_LIMITS = (
    b"\x00" * 4, b"\xff" * 4, struct.pack("<f", float("nan")), struct.pack("<f", float("inf")),
    struct.pack("<f", -3e38), struct.pack("<d", float("nan")), struct.pack("<I", 2**31),
)  # fmt: skip
ELSEWHERE = 1.0  # m from the middle of the body, of a hand that is no neighbour
FAR = (0.0, 3.0, 0.0)  # m; a mutated sample that is still valid is nobody's neighbour


def pressing(seq: int) -> bytes:
    """A sample of one who presses."""
    return ContactSample(seq, 0, 0.0, (RADIUS - 0.01, 0.0, 0.0), (2.0, 0.0, 0.0)).encode()


class Victim(threading.Thread):
    """One who presses and checks each patch.

    Args:
        url: Of the server.

    Attributes:
        patches: That have come.
        changed: Largest change of its force against the settled one [N].
        moved: Largest change of the surface in front of it [m].
        settled: Whether its force has come.
    """

    def __init__(self, url: str) -> None:
        super().__init__(daemon=True)
        self.patches, self.changed, self.moved = 0, 0.0, 0.0
        self.settled, self.over = threading.Event(), False
        self._url = url

    def run(self) -> None:
        """Press until it is over."""
        protocols = [Subprotocol(SUBPROTOCOL)]
        first: Patch | None = None
        with connect(self._url, subprotocols=protocols, proxy=None) as ws:
            ws.send(encode_control(Hello(protocol=PROTOCOL_VERSION, name="victim", key="v" * 16)))
            ws.send(pressing(1))
            for data in ws:
                if self.over:
                    return
                if not isinstance(data, bytes):
                    continue
                patch = Patch.decode(data)
                self.patches += 1
                ws.send(pressing(self.patches + 1))
                if self.patches == 120:
                    first = patch
                    self.settled.set()
                if first is not None:
                    self.changed = max(self.changed, _apart(patch.own_force, first.own_force))
                    self.moved = max(self.moved, _apart(patch.x_free, first.x_free))


def _apart(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return norm((a[0] - b[0], a[1] - b[1], a[2] - b[2]))


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
                Watch(protocol=PROTOCOL_VERSION),
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
            said = Watch(protocol=PROTOCOL_VERSION, encoding="forces")
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


def request(port: int) -> bytes:
    """Of a websocket."""
    lines = (
        "GET / HTTP/1.1", f"Host: 127.0.0.1:{port}", "Upgrade: websocket", "Connection: Upgrade",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Version: 13",
        f"Sec-WebSocket-Protocol: {SUBPROTOCOL}", "", "",
    )  # fmt: skip
    return "\r\n".join(lines).encode()


def attack(port: int, connections: int, seed: int) -> None:
    """One connection after the other, with a few frames each."""
    fuzzer = Fuzzer(seed)
    for number in range(connections):
        with (
            contextlib.suppress(OSError),
            socket.create_connection(("127.0.0.1", port), 5.0, (HOSTILE, 0)) as end,
        ):
            hello = make_frame(fuzzer.hello(), KEY) if number % 2 else b""
            frames = b"".join(fuzzer.frame() for _ in range(4))
            end.sendall(request(port) + hello + frames)
            end.shutdown(socket.SHUT_WR)
            while end.recv(65536):
                pass


class Played:
    """A room without sockets, with a victim in it.

    Args:
        seed: Of the hostile; None for nobody but the victim.
    """

    def __init__(self, seed: int | None) -> None:
        room = Room(Balloon(BalloonSettings(subdivisions=2)), ServerSettings(max_users=8))
        free = Budget(1e6, 1e6)
        entrance = Entrance(Sources(Limits(joins=free)))
        self.lobby = Lobby(room, Audience(room, model=None), entrance)
        self.fuzzer = None if seed is None else Fuzzer(seed)
        self._hostile: list[Peer] = []
        self._seq, self._now = 0, 0.0
        self.closed = 0
        self._victim = self._connect(encode_control(Hello(protocol=PROTOCOL_VERSION, name="v")))

    def _connect(self, hello: str | None) -> Peer:
        peer = self.lobby.connect(self._now, SUBPROTOCOL, SUBPROTOCOL)
        if hello is not None:
            self.lobby.receive(peer, hello, self._now, 0.0)
        peer.session.take(clear=True)
        return peer

    def tick(self, frames: int) -> Patch:
        """Hostile frames, then a tick; returns the victim's patch."""
        for k in range(frames if self.fuzzer is not None else 0):
            assert self.fuzzer is not None
            if len(self._hostile) < 4:
                self._hostile.append(self._connect(self.fuzzer.hello() if k % 3 else None))
            peer = self._hostile[k % len(self._hostile)]
            self.lobby.receive(peer, self.fuzzer.message(), self._now, 0.0)
            if peer.session.close is not None:
                self.closed += 1
                self._hostile.remove(peer)
                self.lobby.disconnect(peer, "")
        self._seq += 1
        self.lobby.receive(self._victim, pressing(self._seq), self._now, 0.0)
        self._now += PERIOD
        self.lobby.tick(self._now)
        self.lobby.serve(self._now)
        for peer in self.lobby.peers:
            peer.session.take(clear=True)
        assert self._victim.user is not None
        return self.lobby.room.patches[self._victim.user]


def at_a_room(frames: int, seed: int) -> dict[str, float | int]:
    """Frames at a lobby; how the victim's patches differ from those of one who is alone."""
    attacked, alone = Played(seed), Played(None)
    sizes: list[int] = []
    different = 0
    start = time.monotonic()
    ticks = max(8, frames // FRAMES_A_TICK)
    for k in range(ticks):
        theirs, own = attacked.tick(FRAMES_A_TICK), alone.tick(0)
        different += theirs != own
        if k % (ticks // 8) == 0:
            sizes.append(resident(os.getpid()))
    return {
        "frames": ticks * FRAMES_A_TICK,
        "seconds": time.monotonic() - start,
        "peers_closed": attacked.closed,
        "patches": ticks,
        "patches_that_differ": different,
        "memory_growth": sizes[-1] / sizes[2] - 1.0,
    }


def at_a_server(connections: int, seed: int) -> tuple[dict[str, float | int], list[str]]:
    """Connections with rubbish at a server process; figures, and what was wrong."""
    with tempfile.TemporaryDirectory() as name:
        log = Path(name) / "server.log"
        limits = [word for limit in FREE for word in ("--limit", limit)]
        server = Process("serve", "--port", "0", "--quiet", *limits, log=log)
        url = server.first_line().removeprefix("listening ")
        victim = Victim(url)
        victim.start()
        victim.settled.wait(30.0)
        sizes: list[int] = []
        for part in range(8):
            attack(int(url.rpartition(":")[2]), connections // 8, seed + part)
            sizes.append(resident(server.pid))
        alive = server.running and victim.is_alive()
        victim.over = True
        victim.join(5.0)
        server.wait()
        text = log.read_text()
    grown = sizes[-1] / sizes[2] - 1.0
    wrong = [
        *([] if alive else ["the server or the victim's connection ended"]),
        *(["a traceback in the log"] if "Traceback" in text else []),
        *([f"the server's memory grew by {100 * grown:.1f} %"] if grown > GROWTH else []),
        *(
            [f"the victim's force changed by {victim.changed:g} N"]
            if victim.changed > STILL
            else []
        ),
    ]
    figures: dict[str, float | int] = {
        "connections": connections,
        "server_memory_growth": grown,
        "server_memory_bytes": sizes[-1],
        "victim_patches": victim.patches,
        "victim_force_change_N": victim.changed,
        "victim_surface_change_m": victim.moved,
        "log_lines": len(text.splitlines()),
    }
    return figures, wrong


def main() -> None:
    """Attack, print and judge."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--connections", type=int, default=4000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    row = at_a_room(options.frames, options.seed)
    wrong = [f"{row['patches_that_differ']} patches differ"] if row["patches_that_differ"] else []
    if row["memory_growth"] > GROWTH:
        wrong.append(f"memory grew by {100 * row['memory_growth']:.1f} %")
    figures, found = at_a_server(options.connections, options.seed)
    row, wrong = row | figures, wrong + found
    print("\n".join(f"{key} {value:.4g}" for key, value in row.items()))
    print("\n".join(wrong) or "nothing was wrong")
    json_report.write(options, [row | {"wrong": len(wrong)}])
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
