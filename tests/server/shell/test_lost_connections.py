"""Connections that end without a farewell: whose name and seat are kept, on real sockets."""

from __future__ import annotations

import asyncio

import pytest

from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import Error, Welcome, encode_control
from cohaptic.runtime.transport import WEBSOCKET_OPTIONS
from cohaptic_server.bodies.balloon.balloon import Balloon
from tests.patience import PATIENCE
from tests.server.peers import hello
from tests.server.shell.stage import Client, serving, visit

pytestmark = pytest.mark.live

ELSEWHERE = ("127.0.0.2", 0)  # another address than everybody else's


async def comes(client: Client, name: str, key: str) -> int:
    """The code with which a hello is refused; 0 for a welcome."""
    said = hello(name).model_copy(update={"key": key * 16})
    await client.ws.send(encode_control(said))
    answer = await client.hear()
    if isinstance(answer, Error):
        return answer.code
    assert isinstance(answer, Welcome)
    return 0


async def finds(url: str, name: str, key: str) -> int:
    async with visit(url, local_addr=ELSEWHERE) as client:
        return await comes(client, name, key)


async def keeps_both(url: str, name: str) -> None:
    assert await finds(url, name, "b") == CloseCode.NAME_TAKEN.value
    assert await finds(url, "other", "b") == CloseCode.ROOM_FULL.value
    assert await finds(url, name, "a") == 0


def test_who_answers_no_ping_keeps_name_and_seat(
    small_balloon: Balloon, monkeypatch: pytest.MonkeyPatch
) -> None:
    quick = {"ping_interval": 0.2, "ping_timeout": 0.2, "close_timeout": 0.1}
    for option, value in quick.items():
        monkeypatch.setitem(WEBSOCKET_OPTIONS, option, value)

    async def happen() -> None:
        async with serving(small_balloon, max_users=1) as served, visit(served.url) as client:
            assert await comes(client, "ann", "a") == 0
            # A seat is kept for as long as it was taken.
            served.server.clock.origin += 10.0
            await client.play(2)
            client.ws.transport.pause_reading()
            async with asyncio.timeout(PATIENCE):
                while served.server.room.members:
                    await asyncio.sleep(0.01)
            await keeps_both(served.url, "ann")
            client.ws.transport.abort()

    asyncio.run(happen())
