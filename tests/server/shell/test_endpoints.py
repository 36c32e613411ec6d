"""Kinds of connections that are added to a server: who is let in, and who pays for an error."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from collections.abc import AsyncGenerator

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Origin, Subprotocol

from cohaptic.errors import CloseCode
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic_server.shell.endpoint import Endpoint
from cohaptic_server.shell.wire import Wire
from tests.patience import PATIENCE
from tests.server.shell.stage import Stage

pytestmark = pytest.mark.live

NEAR, FOR_ALL, FAST, IDLE = "near.test", "for-all.test", "fast.test", "idle.test"
GROUP = "group.test"
ELSEWHERE, BESIDE = Origin("https://elsewhere.example"), Origin("http://localhost:5173")
ended: set[int] = set()


async def echo(ws: Wire) -> None:
    while True:
        said = await ws.recv()
        ws.taken()
        if said == "raise":
            raise RuntimeError("a fault of the route")
        await ws.send(said)


async def idle(ws: Wire) -> None:
    number = int(str(await ws.recv()))
    ws.taken()
    await ws.send("here")
    try:
        await asyncio.Event().wait()
    finally:
        ended.add(number)


async def in_a_group(ws: Wire) -> None:
    """The natural form of an endpoint that reads and writes."""
    async with asyncio.TaskGroup() as group:
        group.create_task(echo(ws))
        group.create_task(asyncio.Event().wait())


@pytest.fixture(scope="module")
def offering(stage: Stage) -> Stage:
    stage.server.add_endpoint(NEAR, Endpoint(echo, longest=200))
    stage.server.add_endpoint(FOR_ALL, Endpoint(echo, longest=200, own_page_only=False))
    stage.server.add_endpoint(FAST, Endpoint(echo, longest=200, as_fast_as_served=True))
    stage.server.add_endpoint(IDLE, Endpoint(idle, longest=200, leaving=0.05))
    stage.server.add_endpoint(GROUP, Endpoint(in_a_group, longest=200))
    return stage


@contextlib.asynccontextmanager
async def come(
    url: str, *kinds: str, origin: Origin | None = None
) -> AsyncGenerator[ClientConnection]:
    offered = [Subprotocol(kind) for kind in kinds]
    async with (
        asyncio.timeout(PATIENCE),
        connect(url, subprotocols=offered, proxy=None, compression=None, origin=origin) as ws,
    ):
        yield ws


async def says(url: str, word: str, *kinds: str, origin: Origin | None = None) -> str:
    """The answer to a word, the refusal, or the code of the close."""
    try:
        async with come(url, *kinds, origin=origin) as ws:
            await ws.send(word)
            return str(await ws.recv())
    except InvalidStatus as refused:
        return bytes(refused.response.body or b"").decode()
    except ConnectionClosed as closed:
        return code(closed)


def code(closed: ConnectionClosed) -> str:
    return "none" if closed.rcvd is None else str(closed.rcvd.code)


def test_programs_of_this_machine_come_in_and_pages_from_elsewhere_do_not(offering: Stage) -> None:
    assert offering.during(says(offering.url, "a" * 200, NEAR)) == "a" * 200
    for origin in (ELSEWHERE, BESIDE):
        reported = offering.during(says(offering.url, "a", NEAR, origin=origin))
        assert "only the page of this server, on the same machine" in reported


def test_an_endpoint_for_all_asks_for_origin_and_host_as_for_a_hand(offering: Stage) -> None:
    assert offering.during(says(offering.url, "a", FOR_ALL)) == "a"
    assert offering.during(says(offering.url, "a", FOR_ALL, origin=BESIDE)) == "a"
    reported = offering.during(says(offering.url, "a", FOR_ALL, origin=ELSEWHERE))
    assert "see --allow-origin" in reported


def test_one_that_is_checked_is_the_one_that_is_chosen(offering: Stage) -> None:
    """Whatever is offered beside it: nobody comes to the stricter one by the check of the other."""
    for kinds in itertools.permutations((NEAR, FOR_ALL, SUBPROTOCOL)):
        strict = kinds.index(NEAR) < kinds.index(FOR_ALL)
        reported = offering.during(says(offering.url, "a", *kinds, origin=BESIDE))
        assert (reported != "a") == strict, kinds


def test_what_is_too_long_or_too_much_ends_that_connection_alone(offering: Stage) -> None:
    async def chatter(kind: str) -> str:
        async with come(offering.url, IDLE) as other, come(offering.url, kind) as ws:
            await other.send("1")
            assert await other.recv() == "here"
            try:
                for _ in range(1000):  # below the budget of samples, above that of words
                    await ws.send("a")
                    await ws.recv()
            except ConnectionClosed as closed:
                return code(closed)
            finally:
                assert other.close_code is None
            return "none"

    assert offering.during(says(offering.url, "a" * 201, NEAR)) == "1009"
    assert offering.during(chatter(NEAR)) == str(CloseCode.TOO_MANY.value)
    assert offering.during(chatter(FAST)) == "none"
    assert offering.during(says(offering.url, "a", NEAR)) == "a"


def test_a_fault_of_the_route_is_in_the_log_and_ends_its_connection(
    offering: Stage, caplog: pytest.LogCaptureFixture
) -> None:
    assert offering.during(says(offering.url, "raise", NEAR)) == "1011"
    assert "near.test of 127.0.0.1 has failed: RuntimeError('a fault of the route')" in caplog.text
    assert offering.during(says(offering.url, "a", NEAR)) == "a"
