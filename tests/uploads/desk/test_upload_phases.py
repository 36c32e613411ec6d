"""Visitors who go, servers that stop, and many hands, in every phase of an upload."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterator
from pathlib import Path

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.upload_messages import (
    CHUNK,
    SUBPROTOCOL,
    BeginUpload,
    Examined,
    Prepared,
    PrepareObject,
    Progress,
    Refused,
    UploadOffer,
)
from cohaptic_server.bodies.balloon.balloon import Balloon
from tests.server.shell.stage import names
from tests.uploads.desk.stage_of_uploads import (
    LONG,
    after_progress,
    begin,
    bring,
    desk_of,
    is_gone,
    said,
    stay,
)
from tests.uploads.test_worker import block_vtu, cube

pytestmark = pytest.mark.live


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))


@pytest.fixture
def runner() -> Iterator[asyncio.Runner]:
    with asyncio.Runner() as runner:
        yield runner


PHASES = ("begun", "half sent", "examined", "refused", "preparing")


async def reach(ws: ClientConnection, phase: str) -> None:
    """Go on with an upload until it is in this phase."""
    content = block_vtu(6)
    if phase in ("begun", "half sent"):
        await ws.send(encode_control(BeginUpload(name="block.vtu", size=len(content))))
        if phase == "half sent":
            await ws.send(content[: len(content) // 2][:CHUNK])
        return
    await begin(ws, content, "block.vtu")
    assert isinstance(await said(ws), Examined)
    if phase == "refused":
        await ws.send(encode_control(PrepareObject(fix="z < -1", young=6e3)))
        assert isinstance(await after_progress(ws), Refused)
    if phase == "preparing":
        await ws.send(encode_control(PrepareObject(fix="z < 15%", young=6e3)))
        assert isinstance(await said(ws), Progress)


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("how", ["aborts", "closes"])
def test_who_goes_in_any_phase_takes_the_worker_along_and_the_next_one_is_served(
    phase: str, how: str, runner: asyncio.Runner, small_balloon: Balloon
) -> None:
    async def happen() -> None:
        async with desk_of(small_balloon) as (served, desk), stay(served.url) as steady:
            await steady.join(next(names))
            async with bring(served.url) as ws:
                await reach(ws, phase)
                while desk.worker is None:
                    await asyncio.sleep(0.01)
                pid = desk.worker.pid
                if how == "aborts":
                    ws.transport.abort()
                else:
                    await ws.close()
            assert await is_gone(pid)
            async with asyncio.timeout(LONG):
                while desk.busy:
                    await asyncio.sleep(0.01)
            await steady.play(3)
            async with bring(served.url) as ws:
                await begin(ws, cube())
                assert isinstance(await said(ws), Examined)

    runner.run(happen())


@pytest.mark.parametrize("phase", PHASES)
def test_a_server_that_stops_in_any_phase_leaves_no_worker(
    phase: str, runner: asyncio.Runner, small_balloon: Balloon
) -> None:
    async def happen() -> None:
        async with desk_of(small_balloon) as (served, desk):
            ws = await connect(
                served.url, subprotocols=[Subprotocol(SUBPROTOCOL)], compression=None, proxy=None
            )
            assert isinstance(await said(ws), UploadOffer)
            await reach(ws, phase)
            while desk.worker is None:
                await asyncio.sleep(0.01)
            pid = desk.worker.pid
        # The server has stopped.
        assert await is_gone(pid)
        ws.transport.abort()

    runner.run(happen())


def test_eight_hands_feel_every_tick_of_an_upload_and_all_come_back(
    runner: asyncio.Runner, small_balloon: Balloon
) -> None:
    async def happen() -> None:
        async with desk_of(small_balloon) as (served, _), contextlib.AsyncExitStack() as all_of:
            hands = [await all_of.enter_async_context(stay(served.url)) for _ in range(8)]
            for hand in hands:
                await hand.join(next(names))
            async with asyncio.timeout(LONG), asyncio.TaskGroup() as group:
                ended = [group.create_task(hand.end()) for hand in hands]
                async with bring(served.url) as ws:
                    await begin(ws, block_vtu(), "block.vtu")
                    assert isinstance(await said(ws), Examined)
                    await ws.send(encode_control(PrepareObject(fix="z < 15%", young=6e3)))
                    assert isinstance(await after_progress(ws), Prepared)
            for task in ended:
                code, _, _ = task.result()
                assert code == CloseCode.OBJECT_CHANGED.value
            back = [await all_of.enter_async_context(stay(served.url)) for _ in range(8)]
            for hand in back:
                await hand.join(next(names))
            for hand in back:
                await hand.play(3)

    runner.run(happen())
