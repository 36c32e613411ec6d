"""The terminal closes in which a server was started: it tells everybody and ends."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from cohaptic.errors import CloseCode
from tests.patience import PATIENCE
from tests.server.shell.stage import visit

pytestmark = [
    pytest.mark.live,
    pytest.mark.usefixtures("terminal"),
    pytest.mark.skipif(sys.platform == "win32", reason="terminals of another kind"),
]

# Python as the first process of a terminal's session, which hears first that it closes.
IN_A_TERMINAL = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execv(sys.executable, [sys.executable, "-m", "cohaptic", "serve", *sys.argv[1:]])
"""


class InTerminal:
    """A server in a terminal, whose first line goes to a pipe."""

    def __init__(self, *options: str) -> None:
        import pty

        self.screen, terminal = pty.openpty()
        self.process = subprocess.Popen(
            [sys.executable, "-c", IN_A_TERMINAL, *options],
            stdin=terminal, stdout=subprocess.PIPE, stderr=terminal, start_new_session=True,
        )  # fmt: skip
        os.close(terminal)
        assert self.process.stdout is not None
        self.url = self.process.stdout.readline().decode().split()[1]

    def close(self) -> None:
        os.close(self.screen)
        self.screen = -1

    def end(self) -> None:
        if self.screen >= 0:
            self.close()
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()


@pytest.mark.parametrize("many", [False, True])
def test_a_server_ends_in_order_when_its_terminal_closes(many: bool, tmp_path: Path) -> None:
    config = tmp_path / "rooms.toml"
    config.write_text('port = 0\n[rooms.one]\nbody = "spring"\n')
    options = ["--config", str(config)] if many else ["--port", "0", "--body", "spring"]
    server = InTerminal(*options)

    async def touch() -> tuple[int, str]:
        async with visit(server.url + ("/r/one" if many else "")) as hand:
            await hand.join("left")
            await hand.play(3)
            # With its terminal there it reads its files again.
            server.process.send_signal(signal.SIGHUP)
            await hand.play(30)
            server.close()
            return (await hand.end())[:2]

    with contextlib.closing(contextlib.ExitStack()) as after:
        after.callback(server.end)
        assert asyncio.run(touch()) == (CloseCode.SERVER_STOPS.value, "the server stops")
        assert server.process.wait(PATIENCE) == 0


def test_under_nohup_a_server_outlives_its_terminal() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        server = InTerminal("--port", "0", "--body", "spring")
    finally:
        signal.signal(signal.SIGHUP, before)

    async def touch() -> None:
        async with visit(server.url) as hand:
            await hand.join("left")
            await hand.play(3)
            server.close()
            await hand.play(60)

    with contextlib.closing(contextlib.ExitStack()) as after:
        after.callback(server.end)
        asyncio.run(touch())
        assert server.process.poll() is None
