"""Visitors who choose what cannot be, and may choose again; and servers of nonlinear objects."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.upload_messages import (
    Examined,
    Prepared,
    PrepareObject,
    Refused,
)
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_uploads.limits import UploadLimits
from tests.uploads.desk.stage_of_uploads import (
    after_progress,
    begin,
    bring,
    desk_of,
    refusal,
    said,
)
from tests.uploads.test_worker import block_vtu

pytestmark = pytest.mark.live


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))


@pytest.fixture
def runner() -> Iterator[asyncio.Runner]:
    with asyncio.Runner() as runner:
        yield runner


def test_what_was_chosen_wrong_is_told_and_may_be_chosen_again(
    runner: asyncio.Runner, small_balloon: Balloon
) -> None:
    async def happen() -> None:
        limits = UploadLimits(tries=3)
        async with desk_of(small_balloon, limits) as (served, desk), bring(served.url) as ws:
            await begin(ws, block_vtu(), "block.vtu")
            examined = await said(ws)
            assert isinstance(examined, Examined)
            assert desk.worker is not None
            worker = desk.worker.pid
            for left, fix, scale, about in ((2, "z < -1", None, "held"), (1, "z < 9%", 99, "size")):
                wish = PrepareObject(fix=fix, young=6e3, scale=scale)
                await ws.send(encode_control(wish))
                answer = await after_progress(ws)
                assert isinstance(answer, Refused)
                assert (answer.about, answer.tries) == (about, left)
            # The same process still has the file.
            assert desk.worker.pid == worker
            await ws.send(encode_control(PrepareObject(fix="z < 15%", young=6e3, scale=2.0)))
            answer = await after_progress(ws)
            assert isinstance(answer, Prepared)
            assert "--scale 2.0" in answer.command
            assert np.ptp(served.server.room.body.mesh.vertices[:, 2]) == pytest.approx(0.2)

    runner.run(happen())


def test_who_chooses_wrong_too_often_has_to_come_again(
    runner: asyncio.Runner, small_balloon: Balloon
) -> None:
    async def happen() -> None:
        async with desk_of(small_balloon, UploadLimits(tries=2)) as (served, desk):
            async with bring(served.url) as ws:
                await begin(ws, block_vtu(), "block.vtu")
                assert isinstance(await said(ws), Examined)
                await ws.send(encode_control(PrepareObject(fix="z < -1", young=6e3)))
                assert isinstance(await after_progress(ws), Refused)
                await ws.send(encode_control(PrepareObject(fix="z < -1", young=6e3)))
                assert "what is held does not fit" in await refusal(ws)
            while desk.busy:
                await asyncio.sleep(0.01)

    runner.run(happen())
