"""A server and a client whose output nobody reads: full pipes, and terminals that are stopped."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

from cohaptic.protocol.messages import UserLeft
from cohaptic.protocol.patch import Patch
from cohaptic.vec import norm
from cohaptic_tools.demo.analysis import Recording
from tests.patience import PATIENCE
from tests.server.shell.stage import Client, visit

pytestmark = [
    pytest.mark.live,
    pytest.mark.usefixtures("terminal"),
    pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals"),
]


@contextlib.contextmanager
def full_pipe() -> Generator[int]:
    """The end to write to of a pipe in which there is room for nothing."""
    reads, writes = os.pipe()
    os.set_blocking(writes, False)
    for size in (4096, 1):
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(writes, b"\n" * size)
    os.set_blocking(writes, True)
    yield writes
    os.close(reads)
    os.close(writes)


@contextlib.contextmanager
def stopped_terminal() -> Generator[int]:
    """One on which somebody has pressed Ctrl-S."""
    import pty

    screen, terminal = pty.openpty()
    os.write(screen, b"\x13")
    yield terminal
    os.close(screen)
    os.close(terminal)


def start(*arguments: str, out: int, err: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "cohaptic", *arguments]
    return subprocess.Popen(command, stdout=out, stderr=err, start_new_session=True)


async def until_left(hand: Client) -> UserLeft:
    while True:
        for news in hand.news:
            if isinstance(news, UserLeft) and news.name == "left":
                return news
        await hand.play(1)


async def play(url: str, touching: subprocess.Popen[bytes]) -> tuple[list[Patch], UserLeft]:
    """What a second hand feels of the first, whichever came first, and how the first goes."""
    async with asyncio.timeout(2.0 * PATIENCE), visit(url, patience=3.0 * PATIENCE) as hand:
        await hand.join("right")
        felt = list[Patch]()
        while sum(norm(patch.u_others) > 0.0 for patch in felt) < 120:
            felt += await hand.play(10)
        assert not any(isinstance(news, UserLeft) for news in hand.news)
        touching.send_signal(signal.SIGHUP)
        return felt, await until_left(hand)


@pytest.mark.parametrize(
    ("unread", "options"), [(full_pipe, ["--json-lines"]), (stopped_terminal, [])]
)
def test_neither_a_server_nor_a_client_waits_for_who_does_not_read_what_it_says(
    unread: Callable[[], contextlib.AbstractContextManager[int]],
    options: list[str],
    tmp_path: Path,
) -> None:
    """Nor at the end: it comes in time, and what is to be written is."""
    with unread() as out:
        run(out, options, tmp_path / "left.npz")


def run(out: int, options: list[str], record: Path) -> None:
    serving = start("serve", "--port", "0", out=subprocess.PIPE, err=out)
    assert serving.stdout is not None
    processes = [serving]
    try:
        url = serving.stdout.readline().decode().split()[1]
        touching = start(
            "touch", url, "--name", "left", "--record", str(record), *options, out=out, err=out
        )
        processes.append(touching)
        _, left = asyncio.run(play(url, touching))
        assert left.reason == "bye"
        assert touching.wait(PATIENCE) == 0
        assert len(Recording.load(record).columns["t"]) > 100
        serving.send_signal(signal.SIGTERM)
        assert serving.wait(PATIENCE) == 0
    finally:
        for process in processes:
            process.kill()
            process.wait()
        serving.stdout.close()
