"""A visitor's file on a server whose disk is full: one sentence, and the room goes on."""

from __future__ import annotations

import asyncio
from collections.abc import Generator
from pathlib import Path

import pytest

from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.upload_messages import Examined, PrepareObject
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from tests.server.shell.stage import names
from tests.small_disk import fill, small_disk
from tests.uploads.desk.stage_of_uploads import (
    LONG,
    begin,
    bring,
    desk_of,
    is_gone,
    refusal,
    said,
    stay,
)
from tests.uploads.test_worker import block_vtu, cube

pytestmark = pytest.mark.live


@pytest.fixture
def disk(tmp_path: Path) -> Generator[Path]:
    with small_disk(tmp_path / "disk", "4m") as folder:
        yield folder


async def refused(url: str, content: bytes, name: str) -> str:
    """Why a file came to nothing; the object of everybody is asked for if it can be examined."""
    async with bring(url) as ws:
        await begin(ws, content, name)
        answer = await said(ws)
        if isinstance(answer, Examined):
            wish = PrepareObject(fix=answer.fix, young=6e3, poisson=0.3)
            await ws.send(encode_control(wish))
            return await refusal(ws)
        return getattr(answer, "message", "") or await refusal(ws)


@pytest.mark.parametrize(
    ("where", "name", "content"),
    [
        ("nowhere", "a.vtu", block_vtu()),
        ("no_store", "a.vtu", block_vtu()),
        ("no_store", "b.stl", cube()),
    ],
)
def test_on_a_full_disk_an_upload_is_one_sentence_and_costs_the_room_nothing(
    where: str, name: str, content: bytes, disk: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    body, store = Balloon(BalloonSettings(subdivisions=2, contact_radius=0.03)), disk / "store"
    monkeypatch.setenv("COHAPTIC_CACHE", str(store))
    if where == "nowhere":  # the library then takes another folder for what is in work
        monkeypatch.setenv("TMPDIR", str(disk))
        monkeypatch.setattr("tempfile.tempdir", None)

    async def happen() -> str:
        async with desk_of(body) as (served, desk), stay(served.url) as before:
            await before.join(next(names))
            await before.play(3)
            fill(disk)
            async with asyncio.timeout(LONG), asyncio.TaskGroup() as both:
                failing = both.create_task(refused(served.url, content, name))
                while not failing.done():
                    await before.play(10)  # it is not asked to leave
            assert served.server.room.body is body
            while desk.busy:
                await asyncio.sleep(0.01)
            assert desk.worker is None or is_gone(desk.worker.pid)
            assert await before.play(3)
            return failing.result()

    why = asyncio.run(happen())
    assert why.startswith("this server cannot keep")
    assert "\n" not in why
    assert "Traceback" not in why
    assert str(tmp_path) not in why
    assert not any(store.glob("**/*.part"))
