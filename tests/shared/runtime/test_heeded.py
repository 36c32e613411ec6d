"""Every long command ends on SIGINT and SIGTERM, also one that was started with SIGINT ignored."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

from cohaptic.runtime.heeded import signals_heeded
from tests.client.devices.until import until

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals"),
]

ROOT = Path(__file__).parents[3]
PATIENCE = 60.0  # s for a command to be at work, on a machine that is busy with other tests
INTERRUPTED = 130  # 128 and the number of SIGINT
AT_ONCE = 0  # commands that run until somebody ends them: that is no failure
ROOMS = 'port = 0\n[rooms.one]\nbody = "spring"\n'


class Command:
    """A command as a shell starts it in its background: with SIGINT ignored.

    Args:
        arguments: Of `cohaptic`.
        folder: For its cache.
    """

    def __init__(self, *arguments: str, folder: Path) -> None:
        self.said = b""
        self.process = subprocess.Popen(
            [sys.executable, "-m", "cohaptic", *arguments],
            env={
                **os.environ,
                "COHAPTIC_CACHE": str(folder / "cache"),
                "PYTHONUNBUFFERED": "1",
            },
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
        )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        while got := os.read(self.process.stdout.fileno(), 4096):
            self.said += got

    def says(self, words: str) -> None:
        """Wait until it has said this."""
        self.until(lambda: words.encode() in self.said)

    def until(self, condition: Callable[[], bool]) -> None:
        """Wait for what shows that it is at work."""
        until(lambda: condition() or self.process.poll() is not None, PATIENCE)
        assert condition(), self.said.decode()

    def ended_by(self, number: signal.Signals) -> int:
        """Its exit status after a signal."""
        assert self.process.poll() is None, self.said.decode()
        self.process.send_signal(number)
        return self.process.wait(PATIENCE)

    def close(self) -> None:
        """Kill it, if it lives, and see that nothing holds its output any more."""
        self.process.kill()
        self.process.wait()
        self._reader.join(PATIENCE)
        assert not self._reader.is_alive(), "a process that it started goes on"
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            pipe.close()


@pytest.fixture
def silent() -> Generator[socket.socket]:
    """A server that accepts, and never says anything."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(PATIENCE)
        yield server


Start = Callable[..., Command]


@pytest.fixture
def start(tmp_path: Path) -> Generator[Start]:
    started: list[Command] = []

    def begin(*arguments: str) -> Command:
        started.append(Command(*arguments, folder=tmp_path))
        return started[-1]

    yield begin
    for command in started:
        command.close()


both = pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])


@both
@pytest.mark.parametrize(
    ("arguments", "words", "status"),
    [
        (("serve", "--port", "0", "--body", "spring"), "listening ws", AT_ONCE),
        (("serve", "--config", "ROOMS"), "listening ws", AT_ONCE),
        (("touch", "ws://127.0.0.1:9", "--name", "ann", "--wait", "600"), "again", AT_ONCE),
        (("demo", "--no-browser", "--duration", "600"), "starting the server", INTERRUPTED),
        (("doctor", "--seconds", "600"), "measuring", INTERRUPTED),
    ],
    ids=lambda value: " ".join(value[:2]) if isinstance(value, tuple) else "",  # pyright: ignore
)
def test_a_signal_ends_a_command_with_the_status_of_its_signal(
    start: Start,
    tmp_path: Path,
    arguments: tuple[str, ...],
    words: str,
    status: int,
    number: signal.Signals,
) -> None:
    rooms = tmp_path / "rooms.toml"
    rooms.write_text(ROOMS)
    command = start(*(str(rooms) if word == "ROOMS" else word for word in arguments))
    command.says(words)
    assert command.ended_by(number) == status


@pytest.mark.parametrize(
    ("what", "number"), [("prepare", signal.SIGINT), ("inspect", signal.SIGTERM)]
)
def test_a_preparation(start: Start, what: str, number: signal.Signals) -> None:
    pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]'")
    command = start("body", what, str(ROOT / "examples/torus.stl"), "--auto")
    command.says("its feet are held")  # the long part comes then
    assert command.ended_by(number) == INTERRUPTED
    command.says("interrupted; what was finished is kept")


@both
@pytest.mark.parametrize("name", ["top", "admin"])
def test_a_command_that_waits_for_a_server(
    start: Start, silent: socket.socket, name: str, number: signal.Signals
) -> None:
    host, port = silent.getsockname()
    command = start(name, f"{'ws' if name == 'admin' else 'http'}://{host}:{port}")
    with silent.accept()[0]:
        assert command.ended_by(number) == INTERRUPTED


def test_a_calibration_that_waits_for_its_user(start: Start) -> None:
    if shutil.which("cc") is None:
        pytest.skip("the firmware of the board needs a C compiler")
    from tests.drivers.oneaxis.board import Board

    board = Board()
    try:
        command = start("devices", "calibrate", f"oneaxis:port={board.path}")
        command.says("then press Enter")
        assert command.ended_by(signal.SIGINT) == INTERRUPTED
    finally:
        board.unplug()


def test_what_ignored_a_signal_before_ignores_it_afterwards() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with pytest.raises(KeyboardInterrupt), signals_heeded():
            signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_sigterm_does_what_sigint_means_by_then_and_a_meaning_of_the_block_stays() -> None:
    heard: list[int] = []
    before = [(number, signal.getsignal(number)) for number in (signal.SIGINT, signal.SIGTERM)]
    try:
        with signals_heeded():
            signal.signal(signal.SIGINT, lambda number, _frame: heard.append(number))
            signal.raise_signal(signal.SIGTERM)
        assert heard == [signal.SIGINT]
        signal.raise_signal(signal.SIGINT)
        assert heard == [signal.SIGINT] * 2
    finally:
        for number, handler in before:
            signal.signal(number, handler)
