"""A visitor who leaves during an upload leaves no file behind, whatever is going on with it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from websockets.asyncio.client import ClientConnection

from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.upload_messages import BeginUpload, Examined, PrepareObject, Progress
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_uploads.kept_files import uploads_folder
from tests.server.shell.stage import Served
from tests.uploads.desk.stage_of_uploads import begin, bring, desk_of, said
from tests.uploads.test_worker import cube

pytestmark = pytest.mark.live


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The system's folder for files that do not stay, and a store beside it."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr("tempfile.tempdir", None)
    return folder


def files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


async def while_it_comes(ws: ClientConnection, temporary: Path) -> None:
    await ws.send(encode_control(BeginUpload(name="a.stl", size=10**6)))
    await ws.send(b"1")
    while not files(temporary):  # the lock, from when on the folder is there
        await asyncio.sleep(0)


async def while_it_is_read(ws: ClientConnection, temporary: Path) -> None:
    await begin(ws, cube())
    while not any(path.suffix == ".stl" for path in files(temporary)):
        await asyncio.sleep(0)


async def while_it_is_prepared(ws: ClientConnection, _: Path) -> None:
    await begin(ws, cube())
    assert isinstance(await said(ws), Examined)
    await ws.send(encode_control(PrepareObject(fix="z < 5%", young=6e3)))
    assert isinstance(await said(ws), Progress)
    assert files(uploads_folder())


@pytest.mark.parametrize("when", [while_it_comes, while_it_is_read, while_it_is_prepared])
@pytest.mark.parametrize("stops", [False, True], ids=["leaves", "server stops"])
def test_nothing_is_left_of_what_came_to_nothing(
    when: Callable[[ClientConnection, Path], Awaitable[None]],
    stops: bool,
    temporary: Path,
    small_balloon: Balloon,
) -> None:
    async def happen() -> None:
        served: Served
        async with desk_of(small_balloon) as (served, desk), bring(served.url) as ws:
            await when(ws, temporary)
            assert desk.busy
            if stops:
                return
            ws.transport.abort()
            while desk.busy:
                await asyncio.sleep(0.01)
            assert files(temporary) == files(uploads_folder()) == []

    asyncio.run(happen())
    assert files(temporary) == files(uploads_folder()) == []
