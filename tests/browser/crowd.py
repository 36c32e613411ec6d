"""Many hands in one process that cost the machine little, for pages that have to show them.

    python -m tests.browser.crowd URL NAME...

Each presses lightly on the balloon, spread round it, until the standard input ends.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import subprocess
import sys
from collections.abc import Generator, Sequence

from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import Hello, encode_control
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.vec import scale
from tests.patience import PATIENCE

RADIUS = 0.1  # m, of the balloon
PERIOD = 0.1  # s between two samples of a hand
GOLDEN = math.pi * (3.0 - math.sqrt(5.0))  # rad; turns by it never come together


async def hand(url: str, name: str, index: int, many: int) -> None:
    """One of them, at its place of a spiral from pole to pole."""
    z = 1.0 - (2.0 * index + 1.0) / many
    level = math.sqrt(1.0 - z * z)
    out = (level * math.cos(GOLDEN * index), level * math.sin(GOLDEN * index), z)
    protocols = [Subprotocol(SUBPROTOCOL)]
    async with connect(
        url, subprotocols=protocols, compression=None, proxy=None, open_timeout=PATIENCE
    ) as ws:
        await ws.send(encode_control(Hello(protocol=PROTOCOL_VERSION, name=name)))
        tick = 0

        async def read() -> None:
            nonlocal tick
            with contextlib.suppress(ConnectionClosed):
                async for data in ws:
                    if isinstance(data, bytes):
                        tick = Patch.decode(data).tick

        reading = asyncio.ensure_future(read())
        seq = 0
        while not reading.done():
            seq += 1
            t = asyncio.get_running_loop().time()
            force = scale(out, 0.8 + 0.4 * math.sin(t + index))
            await ws.send(ContactSample(seq, tick, t, scale(out, 0.95 * RADIUS), force).encode())
            await asyncio.sleep(PERIOD)


async def play(url: str, names: Sequence[str]) -> None:
    """All of them, until the standard input ends."""
    hands = [asyncio.ensure_future(hand(url, name, i, len(names))) for i, name in enumerate(names)]
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    for one in hands:
        one.cancel()
    await asyncio.gather(*hands, return_exceptions=True)


@contextlib.contextmanager
def crowd(url: str, names: Sequence[str]) -> Generator[None]:
    """Them in a process of their own, until the end of the block."""
    command = [sys.executable, "-m", "tests.browser.crowd", url, *names]
    environment = {**os.environ, "PYTHONUTF8": "1"}
    with subprocess.Popen(command, stdin=subprocess.PIPE, env=environment) as process:
        try:
            yield
        finally:
            assert process.stdin is not None
            process.stdin.close()
            process.wait()


if __name__ == "__main__":
    asyncio.run(play(sys.argv[1], sys.argv[2:]))
