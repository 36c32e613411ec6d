"""A million random and mutated frames at a room, and thousands of connections at a server.

    python benchmarks/fuzz.py [--frames 1000000] [--connections 4000] [--seed 1] [--json FILE]

Frames are random bytes, and samples, acks and control messages with bytes changed, cut out, put in
or doubled, or numbers replaced by ones at the limits of their types. A server closes who breaks a
rule and does not look at what else it has sent, so most of them are given to the session host of a
room without a socket, where each is decoded: by users and watchers who have said a good hello, and
by some who have not. Who is closed is followed by another. Beside it is a room with nobody but the
victim, who presses in both; their patches have to be equal in every number. Frames that are valid
samples of a force, or of a hand near the body, are left out: to be there is nobody's fault. Then
connections come to a server process from another address, each with a few such frames, some of
them broken websocket frames, and a victim presses there. It ends with status 1 on any exception, a
difference, a traceback in the log, or if memory grows by more than 5 % after the first quarter.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import tempfile
import threading
import time
from pathlib import Path

from websockets.sync.client import connect
from websockets.typing import Subprotocol

import json_report
from cohaptic.protocol.messages import Hello, encode_control
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.websocket_frames import make_frame
from cohaptic.vec import norm
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.guard.limits import Budget, Limits
from cohaptic_server.guard.sources import Sources
from cohaptic_server.room.peer import Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.session_host import SessionHost
from cohaptic_server.room.session_setup import RoomAdmission
from cohaptic_server.room.watch.scene_broadcast import SceneBroadcast
from cohaptic_server.settings import ServerSettings
from cohaptic_tools.demo.processes import Process
from core_users import PERIOD
from fuzz_frames import KEY, Fuzzer, pressing
from soak_server import resident

HOSTILE = "127.0.0.9"
GROWTH = 0.05
FRAMES_A_TICK = 50
STILL = 1e-3  # N; others who come and go may choose another lag for the room
_UNBOUNDED = ("connections", "joins", "dismissals")
FREE = ("open=2000", "open_in_all=4000", *(f"{name}=100000:100000" for name in _UNBOUNDED))


class Victim(threading.Thread):
    """One who presses and checks each patch.

    Args:
        url: URL of the server.

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


def request(port: int) -> bytes:
    """Request of a websocket."""
    lines = (
        "GET / HTTP/1.1", f"Host: 127.0.0.1:{port}", "Upgrade: websocket", "Connection: Upgrade",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Version: 13",
        f"Sec-WebSocket-Protocol: {SUBPROTOCOL}", "", "",
    )  # fmt: skip
    return "\r\n".join(lines).encode()


def attack(port: int, connections: int, seed: int) -> int:
    """One connection after the other, with a few frames each; how many were taken."""
    fuzzer, taken = Fuzzer(seed), 0
    for number in range(connections):
        with (
            contextlib.suppress(OSError),
            socket.create_connection(("127.0.0.1", port), 5.0, (HOSTILE, 0)) as end,
        ):
            end.sendall(request(port))
            # First: a reset would throw away what has come.
            taken += end.recv(65536).startswith(b"HTTP/1.1 101")
            hello = make_frame(fuzzer.hello(), KEY) if number % 2 else b""
            end.sendall(hello + b"".join(fuzzer.frame() for _ in range(4)))
            end.shutdown(socket.SHUT_WR)
            while end.recv(65536):
                pass
    return taken


class Played:
    """A room without sockets, with a victim in it.

    Args:
        seed: Seed of the hostile; None for nobody but the victim.
    """

    def __init__(self, seed: int | None) -> None:
        room = Room(Balloon(BalloonSettings(subdivisions=2)), ServerSettings(max_users=8))
        free = Budget(1e6, 1e6)
        room_admission = RoomAdmission(Sources(Limits(joins=free)))
        self.session_host = SessionHost(room, SceneBroadcast(room, model=None), room_admission)
        self.fuzzer = None if seed is None else Fuzzer(seed)
        self._hostile: list[Peer] = []
        self._seq, self._now = 0, 0.0
        self.closed = 0
        self._victim = self._connect(encode_control(Hello(protocol=PROTOCOL_VERSION, name="v")))

    def _connect(self, hello: str | None) -> Peer:
        peer = self.session_host.connect(self._now, SUBPROTOCOL, SUBPROTOCOL)
        if hello is not None:
            self.session_host.receive(peer, hello, self._now, 0.0)
        peer.session.take(clear=True)
        return peer

    def tick(self, frames: int) -> Patch:
        """Hostile frames, then a tick; returns the victim's patch."""
        for k in range(frames if self.fuzzer is not None else 0):
            assert self.fuzzer is not None
            if len(self._hostile) < 4:
                self._hostile.append(self._connect(self.fuzzer.hello() if k % 3 else None))
            peer = self._hostile[k % len(self._hostile)]
            self.session_host.receive(peer, self.fuzzer.message(), self._now, 0.0)
            if peer.session.close is not None:
                self.closed += 1
                self._hostile.remove(peer)
                self.session_host.disconnect(peer, "")
        self._seq += 1
        self.session_host.receive(self._victim, pressing(self._seq), self._now, 0.0)
        self._now += PERIOD
        self.session_host.tick(self._now)
        self.session_host.serve(self._now)
        self.session_host.shared_views.step(self._now)
        for peer in self.session_host.peers:
            peer.session.take(clear=True)
        assert self._victim.user is not None
        return self.session_host.room.patches[self._victim.user]


def at_a_room(frames: int, seed: int) -> dict[str, float | int]:
    """Frames at a session host; how the victim's patches differ from those of one who is alone."""
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
        taken = 0
        for part in range(8):
            taken += attack(int(url.rpartition(":")[2]), connections // 8, seed + part)
            sizes.append(resident(server.pid))
        alive = server.running and victim.is_alive()
        victim.over = True
        victim.join(5.0)
        server.wait()
        text = log.read_text()
    grown = sizes[-1] / sizes[2] - 1.0
    wrong = [
        *(
            []
            if taken > 0.9 * connections
            else ["connections were refused before they said anything"]
        ),
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
        "connections_taken": taken,
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
