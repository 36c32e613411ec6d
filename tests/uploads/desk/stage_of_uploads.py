"""Visitors who bring files to a server, for the tests of the shell."""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import AsyncGenerator

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Origin, Subprotocol

from cohaptic.protocol.messages import Error, encode_control
from cohaptic.protocol.upload_messages import (
    CHUNK,
    SUBPROTOCOL,
    BeginUpload,
    Examined,
    Progress,
    UploadAnswer,
    UploadOffer,
    decode_upload_answer,
)
from cohaptic.protocol.version import SUBPROTOCOL as TOUCH
from cohaptic_server.bodies.body import Body
from cohaptic_server.routes import Serving
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_uploads.limits import UploadLimits
from cohaptic_uploads.upload_desk import UploadDesk, take_uploads
from tests.server.shell.stage import Client, Served, serving

LONG = 60.0  # s; a preparation on a busy machine


@contextlib.asynccontextmanager
async def desk_of(
    body: Body, limits: UploadLimits | None = None
) -> AsyncGenerator[tuple[Served, UploadDesk]]:
    """A server that takes files."""
    async with serving(body, allow_upload=True) as served:
        desk = take_uploads(Serving(served.server, ServedBody(body)))
        desk.limits = limits or desk.limits
        yield served, desk


@contextlib.asynccontextmanager
async def bring(url: str, origin: str | None = None) -> AsyncGenerator[ClientConnection]:
    headers = None if origin is None else Origin(origin)
    async with connect(
        url, subprotocols=[Subprotocol(SUBPROTOCOL)], compression=None, proxy=None, origin=headers
    ) as ws:
        offer = await said(ws)
        assert isinstance(offer, UploadOffer)
        yield ws


@contextlib.asynccontextmanager
async def stay(url: str) -> AsyncGenerator[Client]:
    """A visit without an end in time."""
    kinds = [Subprotocol(TOUCH)]
    async with connect(url, subprotocols=kinds, compression=None, proxy=None) as ws:
        try:
            yield Client(ws)
        finally:
            # A goodbye would wait its 10 s behind the patches that nobody has read meanwhile.
            ws.transport.abort()


async def said(ws: ClientConnection) -> UploadAnswer:
    """The next message that is text."""
    while True:
        async with asyncio.timeout(LONG):
            data = await ws.recv()
        if isinstance(data, str):
            return decode_upload_answer(data)


async def after_progress(ws: ClientConnection) -> UploadAnswer:
    """The next word that is no progress."""
    answer = await said(ws)
    while isinstance(answer, Progress):
        answer = await said(ws)
    return answer


async def begin(ws: ClientConnection, content: bytes, name: str = "cube.stl") -> None:
    await ws.send(encode_control(BeginUpload(name=name, size=len(content))))
    for at in range(0, len(content), CHUNK):
        await ws.send(content[at : at + CHUNK])


async def refusal(ws: ClientConnection) -> str:
    """What the server says before it closes."""
    answer = await said(ws)
    while isinstance(answer, Progress | Examined):
        answer = await said(ws)
    assert isinstance(answer, Error)
    with pytest.raises(ConnectionClosed):
        await ws.recv()
    assert ws.close_code == answer.code
    return answer.message


async def is_gone(pid: int) -> bool:
    """Whether a process ends soon."""
    for _ in range(200):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        await asyncio.sleep(0.02)
    return False
