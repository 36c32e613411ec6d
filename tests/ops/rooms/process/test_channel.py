from __future__ import annotations

import asyncio
import socket

import pytest

from cohaptic_ops.rooms.process.channel import open_channel
from cohaptic_ops.rooms.process.reports import LONGEST, Failed, Line, Ready
from tests.patience import PATIENCE

pytestmark = pytest.mark.live


@pytest.mark.parametrize("said", [b"nonsense\n", b"x" * (LONGEST + 1), b'{"kind":"none"}\n'])
def test_what_is_no_line_ends_the_channel(said: bytes) -> None:
    async def main() -> None:
        heard: list[Line] = []
        ended = asyncio.Event()
        one, other = socket.socketpair()
        await open_channel(one, heard.append, ended.set)
        with other:
            other.setblocking(False)
            await asyncio.get_running_loop().sock_sendall(other, said)
            await asyncio.wait_for(ended.wait(), PATIENCE)
        assert heard == []

    asyncio.run(main())


def test_state_is_left_out_while_the_other_end_does_not_read() -> None:
    async def main() -> None:
        one, other = socket.socketpair()
        channel = await open_channel(one, lambda _: None, lambda: None)
        with other:
            written = 0
            while channel.tell_newest(Failed(why="x" * 10_000)):
                written += 1
                assert written < 10_000
            assert not channel.tell_newest(Ready())
            channel.abort()
            await asyncio.sleep(0)

    asyncio.run(main())
