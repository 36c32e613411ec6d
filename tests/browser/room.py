"""A server as a process, and its scene as somebody sees it who is no page."""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
from collections.abc import Callable, Generator
from pathlib import Path

from websockets.sync.client import connect
from websockets.typing import Subprotocol

from cohaptic.clock import SystemClock
from cohaptic.protocol.ack import Ack
from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.rest_mesh import MAX_BYTES, RestMesh
from cohaptic.protocol.scene import Scene
from cohaptic.protocol.scene_users import UserRecord
from cohaptic.protocol.traversal import Traversal
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import Watch
from cohaptic.status.report import TouchStatus
from cohaptic_server.shell.listener import page_address
from cohaptic_tools.demo.processes import Process
from tests.patience import PATIENCE

CLOCK = SystemClock()
Users = dict[int, UserRecord]  # by number
_LOG = itertools.count()


class Room:
    """`cohaptic serve` on a free port of loopback, or on one that was free a moment ago."""

    def __init__(self, folder: Path, *options: str, port: int = 0) -> None:
        self._folder = folder
        self._process = Process("serve", "--port", str(port), *options, log=_log(folder))
        self.url = self._process.first_line().removeprefix("listening ")
        self.address = page_address(self.url)
        self.port = int(self.url.rpartition(":")[2])

    @property
    def pid(self) -> int:
        """Of the server's process."""
        return self._process.pid

    def close(self) -> None:
        self._process.wait()

    def die(self) -> None:
        """As a server does whose machine is switched off."""
        os.kill(self._process.pid, signal.SIGKILL)
        self._process.wait()

    @contextlib.contextmanager
    def hand(self, name: str, *options: str) -> Generator[NativeHand]:
        """`cohaptic touch` here, until the end of the block."""
        hand = NativeHand(self.url, name, options, _log(self._folder))
        try:
            yield hand
        finally:
            hand.process.wait()

    def users(self) -> Users:
        """Who is on the body now, as the server tells those who watch."""
        with contextlib.closing(self.scenes()) as scenes:
            return next(scenes)

    def until(self, condition: Callable[[Users], bool], what: str) -> Users:
        """Wait until those on the body are as they should; what they were then.

        One who watches all the time, since everybody who comes counts at the acceptor: whoever
        looks in again and again is sent away after some seconds.
        """
        deadline = CLOCK.now() + PATIENCE
        with contextlib.closing(self.scenes()) as scenes:
            for users in scenes:
                if condition(users):
                    return users
                assert CLOCK.now() < deadline, f"waited for {what}; there are {users}"
        raise AssertionError("the server has ended")

    def scenes(self) -> Generator[Users]:
        """The same again and again, of one who watches: each who comes counts at the acceptor."""
        with contextlib.closing(self.whole_scenes()) as scenes:
            for scene in scenes:
                yield {user.user: user for user in scene.users}

    def whole_scenes(self) -> Generator[Scene]:
        """The same with the room's lag and all else that a scene has."""
        with connect(
            self.url,
            subprotocols=[Subprotocol(SUBPROTOCOL)],
            compression=None,
            max_size=MAX_BYTES,
            proxy=None,
            open_timeout=PATIENCE,
        ) as ws:
            watch = Watch(protocol=PROTOCOL_VERSION, encoding="forces", rate=60.0)
            ws.send(encode_control(watch))
            mesh: RestMesh | None = None
            while True:
                data = ws.recv(PATIENCE)
                if isinstance(data, str):
                    continue
                if mesh is None:
                    mesh = RestMesh.decode(data)
                    continue
                scene = Scene.decode(data, Traversal.of(len(mesh.vertices), mesh.faces))
                ws.send(Ack(scene.tick).encode())
                yield scene


class NativeHand:
    """A simulated hand from the command line."""

    def __init__(self, url: str, name: str, options: tuple[str, ...], log: Path) -> None:
        # By itself a hand gives up at once, also on a server that is only slow.
        self.process = Process(
            "touch", url, "--name", name, "--wait", f"{PATIENCE:g}", "--json-lines", *options,
            log=log,
        )  # fmt: skip

    @property
    def status(self) -> TouchStatus:
        """Its newest word of itself."""
        line = self.process.line or '{"name": "", "state": "connecting"}'
        return TouchStatus.model_validate_json(line)


def _log(folder: Path) -> Path:
    return folder / f"{next(_LOG)}.log"
