"""Kinds of connections that are added to a server: who is let in, and who pays for an error."""

from __future__ import annotations

import asyncio
import logging

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Origin, Subprotocol

from cohaptic_server.shell.endpoint import Endpoint
from cohaptic_server.shell.wire import Wire
from tests.patience import PATIENCE
from tests.server.shell.stage import Stage

pytestmark = pytest.mark.live

KIND = "echo.test"
ELSEWHERE = Origin("https://elsewhere.example")


async def echo(ws: Wire) -> None:
    while True:
        said = await ws.recv()
        ws.taken()
        if said == "raise":
            raise RuntimeError("a fault of the route")
        await ws.send(said)


async def says(url: str, word: str, origin: Origin | None = None) -> str | bytes:
    kinds = [Subprotocol(KIND)]
    async with (
        asyncio.timeout(PATIENCE),
        connect(url, subprotocols=kinds, proxy=None, compression=None, origin=origin) as ws,
    ):
        assert ws.subprotocol == KIND
        await ws.send(word)
        return await ws.recv()


async def refused(url: str, origin: Origin) -> bytes:
    """Words of the refusal of a page from somewhere."""
    with pytest.raises(InvalidStatus) as error:
        await says(url, "a", origin)
    return bytes(error.value.response.body or b"")


async def closed(url: str, word: str) -> int:
    """The code by which the server closes after a word."""
    with pytest.raises(ConnectionClosed) as error:
        await says(url, word)
    assert error.value.rcvd is not None
    return error.value.rcvd.code


@pytest.fixture
def echoing(stage: Stage) -> Stage:
    stage.server.endpoints[KIND] = Endpoint(echo, longest=200)
    return stage


def test_a_program_of_this_machine_comes_in_and_a_page_from_elsewhere_does_not(
    echoing: Stage,
) -> None:
    assert echoing.during(says(echoing.url, "a" * 200)) == "a" * 200
    told = echoing.during(refused(echoing.url, ELSEWHERE))
    assert b"only the page of this server, on the same machine" in told


def test_an_endpoint_for_all_is_as_open_as_the_room(echoing: Stage) -> None:
    echoing.server.endpoints[KIND] = Endpoint(echo, longest=200, own_page_only=False)
    assert echoing.during(says(echoing.url, "a")) == "a"
    told = echoing.during(refused(echoing.url, ELSEWHERE))
    assert b"see --allow-origin" in told


def test_a_message_that_is_too_long_and_a_fault_of_the_route_end_that_connection_alone(
    echoing: Stage, caplog: pytest.LogCaptureFixture
) -> None:
    assert echoing.during(closed(echoing.url, "a" * 201)) == 1009
    with caplog.at_level(logging.CRITICAL):
        assert echoing.during(closed(echoing.url, "raise")) == 1011
    assert echoing.during(says(echoing.url, "a")) == "a"
