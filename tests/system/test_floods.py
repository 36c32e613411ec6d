"""A server process under floods, beside one who touches: its ticks, and its force.

A patch carries the time of its tick on the server's clock, so the ticks that were left out are seen
however late this process reads. A stretch of each test is without a flood, to compare with.
"""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Generator
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.vec import norm
from cohaptic_tools.demo.processes import Process
from tests.patience import PATIENCE
from tests.server.peers import hello_text, sample
from tests.system.flooder import FLOODS, HTTP

pytestmark = pytest.mark.alone

PERIOD = 1.0 / 60.0  # s
STRETCH = 40  # ticks without a flood, and with one
ROOT = Path(__file__).parents[2]


class Victim(threading.Thread):
    """One who presses and does nothing wrong.

    Attributes:
        patches: All that have come.
    """

    def __init__(self, url: str) -> None:
        super().__init__(daemon=True)
        self.patches: list[Patch] = []
        self._url = url
        self._more = threading.Condition()

    def run(self) -> None:
        protocols = [Subprotocol(SUBPROTOCOL)]
        with (
            contextlib.suppress(ConnectionClosed),
            connect(self._url, subprotocols=protocols, proxy=None) as ws,
        ):
            ws.send(hello_text("victim"))
            ws.send(sample(1).encode())
            for data in ws:
                if isinstance(data, bytes):
                    with self._more:
                        self.patches.append(Patch.decode(data))
                        self._more.notify()
                    answer = sample(len(self.patches) + 1)
                    ws.send(answer._replace(tick=self.patches[-1].tick).encode())

    def play(self, ticks: int) -> list[Patch]:
        """Patches of the next ticks, of which some may be left out."""
        with self._more:
            first = len(self.patches)
            self._more.wait_for(
                lambda: (
                    len(self.patches) > first
                    and self.patches[-1].t_server - self.patches[first].t_server >= ticks * PERIOD
                ),
                timeout=PATIENCE,
            )
            return self.patches[first:]


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Generator[Process]:
    log = tmp_path_factory.mktemp("floods") / "server.log"
    server = Process("serve", "--port", "0", "--quiet", log=log)
    server.first_line()
    yield server
    server.wait()
    assert len(log.read_text().splitlines()) < 100  # lines of floods are limited
    assert "Traceback" not in log.read_text()


@pytest.fixture(scope="module")
def url(server: Process) -> str:
    return server.first.removeprefix("listening ")


@pytest.fixture(scope="module")
def victim(url: str) -> Victim:
    victim = Victim(url)
    victim.start()
    victim.play(STRETCH)  # until its force has come
    return victim


def left_out(patches: list[Patch]) -> int:
    """Ticks that are missing between the first and the last."""
    due = round((patches[-1].t_server - patches[0].t_server) / PERIOD)
    return due - (len(patches) - 1)


@pytest.fixture(scope="module")
def say() -> Generator[Callable[[str], None]]:
    """Tells the process of the floods what to do."""
    flooder = subprocess.Popen(
        [sys.executable, "-m", "tests.system.flooder"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    assert flooder.stdin is not None
    assert flooder.stdout is not None
    reported, heard = flooder.stdin, flooder.stdout
    assert heard.readline() == "ready\n"

    def say(line: str) -> None:
        reported.write(line + "\n")
        reported.flush()
        heard.readline()

    yield say
    flooder.kill()
    flooder.communicate()


@pytest.mark.parametrize("kind", FLOODS)
def test_a_flood_costs_one_who_touches_no_tick_and_no_force(
    url: str, victim: Victim, say: Callable[[str], None], kind: str
) -> None:
    calm = victim.play(STRETCH)
    say(f"{kind} at {url}")
    flooded = victim.play(STRETCH)
    say("enough")
    # A busy machine leaves out some of both; floods cost half of all ticks and more.
    assert left_out(flooded) <= left_out(calm) + 0.1 * STRETCH
    assert min(norm(patch.own_force) for patch in flooded) > 0.95 * norm(calm[0].own_force)


@pytest.mark.skipif(sys.platform != "linux", reason="changes the limits of another process")
def test_a_server_without_files_says_so_to_who_comes_and_goes_on(
    server: Process, url: str, victim: Victim
) -> None:
    import resource

    address = ("127.0.0.1", int(url.rpartition(":")[2]))
    before = resource.prlimit(server.pid, resource.RLIMIT_NOFILE)
    used = max(int(path.name) for path in Path(f"/proc/{server.pid}/fd").iterdir())
    calm = victim.play(STRETCH)
    resource.prlimit(server.pid, resource.RLIMIT_NOFILE, (used + 2, before[1]))
    try:
        with contextlib.ExitStack() as ends:
            held = [
                ends.enter_context(socket.create_connection(address, timeout=PATIENCE))
                for _ in range(60)
            ]
            flooded = victim.play(STRETCH)
            refused = held[-1].recv(1 << 12)
    finally:
        resource.prlimit(server.pid, resource.RLIMIT_NOFILE, before)
    assert refused.startswith(b"HTTP/1.1 503 ")
    assert b"this machine has no more open files" in refused
    assert left_out(flooded) <= left_out(calm) + 0.1 * STRETCH
    with socket.create_connection(address, timeout=PATIENCE) as end:
        end.sendall(HTTP)
        assert end.recv(12) == b"HTTP/1.1 200"
