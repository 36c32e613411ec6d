from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterator

import pytest
from websockets.asyncio.client import connect
from websockets.typing import Subprotocol

from cohaptic.protocol.messages import (
    Bye,
    encode_control,
)
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic_server.bodies.balloon.balloon import Balloon
from tests.server.shell.stage import Client, Stage, serving


@pytest.fixture(scope="module")
def stage(small_balloon: Balloon) -> Iterator[Stage]:
    with asyncio.Runner() as runner:
        context = contextlib.AsyncExitStack()

        async def begin() -> Stage:
            served = await context.enter_async_context(serving(small_balloon))
            ws = await connect(
                served.url, subprotocols=[Subprotocol(SUBPROTOCOL)], compression=None, proxy=None
            )
            steady = Client(ws, probe=(0.09, 0.0, 0.0), force=(2.0, 0.0, 0.0))
            context.push_async_callback(steady.end)
            context.push_async_callback(steady.ws.send, encode_control(Bye()))
            await steady.join("steady")
            return Stage(runner, served.server, served.url, steady)

        yield runner.run(begin())
        runner.run(context.aclose())
