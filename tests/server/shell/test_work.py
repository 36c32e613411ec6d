"""The work of the wire: one write for each client and tick, and no flood that piles up."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import replace
from types import FrameType
from typing import Any, cast

import pytest
from websockets.asyncio.server import Server
from websockets.frames import Frame, Opcode
from websockets.protocol import State
from websockets.server import ServerProtocol
from websockets.typing import Subprotocol

from cohaptic.protocol.messages import UserJoined
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.protocol.websocket_frames import make_frame
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.server import CohapticServer
from cohaptic_server.shell.wire import Wire
from tests.client.plane import PLANE
from tests.server.peers import hello_text, sample
from tests.server.shell.stage import REQUEST

pytestmark = pytest.mark.live

USERS = 4


class Transport:
    """Counts what is written."""

    def __init__(self) -> None:
        self.writes: list[bytes] = []
        self.waiting = 0

    def write(self, data: bytes) -> None:
        self.writes.append(data)

    def is_closing(self) -> bool:
        return False

    def get_write_buffer_size(self) -> int:
        return self.waiting


class Room:
    """A server whose world stands, and users whose bytes come from the test."""

    def __init__(self, body: Balloon, monkeypatch: pytest.MonkeyPatch) -> None:
        self.server = CohapticServer(body, ServerSettings())
        self.transports: list[Transport] = []
        self.wires: list[Wire] = []
        self.seq = 0
        for number in range(USERS):
            self._join(f"user{number}")
        monkeypatch.setattr(self.server.room, "tick", self._stand)
        self.tick()

    def _join(self, name: str) -> None:
        wire = Wire(ServerProtocol(), cast(Server, None))
        # The library's handshake is not part of the work: the request comes, and it is over.
        wire.data_received(REQUEST)
        wire.protocol.state, wire.protocol.subprotocol = State.OPEN, Subprotocol(SUBPROTOCOL)
        transport = Transport()
        wire.transport = cast(asyncio.Transport, transport)
        self.server.connect(wire).receive(hello_text(name))
        self.transports.append(transport)
        self.wires.append(wire)

    def _stand(self, now: float) -> None:
        users = self.server.room.members
        self.server.room.patches = dict.fromkeys(users, replace(self.patch, t_server=now))

    patch: Patch = PLANE

    def hear(self) -> None:
        """A sample from everybody."""
        self.seq += 1
        frame = Frame(Opcode.BINARY, sample(self.seq).encode()).serialize(mask=True)
        for wire in self.wires:
            wire.data_received(frame)

    def tick(self) -> None:
        for transport in self.transports:
            transport.writes.clear()
        self.server.tick()


@pytest.fixture
def room(small_balloon: Balloon, monkeypatch: pytest.MonkeyPatch) -> Generator[Room]:
    with asyncio.Runner() as runner:

        async def make() -> Room:
            return Room(small_balloon, monkeypatch)

        yield runner.run(make())


@contextmanager
def counted() -> Generator[Callable[[], int]]:
    """Counts calls within the context."""
    calls = 0

    def see(_frame: FrameType, event: str, _argument: Any) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    sys.setprofile(see)
    try:
        yield lambda: calls
    finally:
        sys.setprofile(None)


def test_the_messages_of_a_tick_leave_in_one_write_for_each_client(room: Room) -> None:
    """News and a patch too; the news first."""
    room.hear()
    for peer in room.server.session_host.peers:
        peer.session.send(UserJoined(user=9, name="news"))
    room.tick()
    for transport in room.transports:
        (data,) = transport.writes
        news = data[: data.index(b"}") + 1]
        assert news[:1] == b"\x81"
        assert data[len(news) :] == make_frame(room.server.room.patches[1].encode())


def test_who_has_not_taken_the_last_patch_is_not_written_to(room: Room) -> None:
    slow, *others = room.transports
    slow.waiting = 1
    for _ in range(3):
        room.hear()
        room.tick()
        assert slow.writes == []
        assert [len(other.writes) for other in others] == [1] * len(others)
    slow.waiting = 0
    room.tick()
    assert len(slow.writes) == 1


def test_samples_between_two_ticks_are_all_taken_and_the_newest_counts(room: Room) -> None:
    for _ in range(3):
        room.hear()
    touch = next(iter(room.server.room.members.values())).touch
    assert touch is None
    room.tick()
    for member in room.server.room.members.values():
        assert member.touch is not None
        assert member.touch.seq == room.seq


def test_a_flood_between_two_ticks_does_not_pile_up(room: Room) -> None:
    for _ in range(100):
        room.hear()
    with counted() as calls:
        room.tick()
        of_a_flood = calls()
    room.hear()
    with counted() as calls:
        room.tick()
        of_one = calls()
    for member in room.server.room.members.values():
        assert member.touch is not None
        assert member.touch.seq == room.seq
    assert of_a_flood < 3 * of_one
