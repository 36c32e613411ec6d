"""Visitors who bring files, good and bad ones, on real sockets, while somebody touches."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from cohaptic.errors import CloseCode, CohapticError
from cohaptic.protocol.messages import Error, encode_control
from cohaptic.protocol.upload_messages import (
    BeginUpload,
    Examined,
    Prepared,
    PrepareObject,
    Progress,
)
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.body import Body
from cohaptic_uploads.kept_files import uploads_folder
from cohaptic_uploads.limits import UploadLimits
from tests.server.shell.stage import names, visit
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


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))


@pytest.fixture
def runner() -> Iterator[asyncio.Runner]:
    with asyncio.Runner() as runner:
        yield runner


def test_a_file_becomes_the_object_of_everybody(
    runner: asyncio.Runner, small_balloon: Balloon
) -> None:
    async def happen() -> None:
        async with desk_of(small_balloon) as (served, _), stay(served.url) as before:
            number = await before.join(next(names))
            await before.play(3)
            async with asyncio.timeout(LONG), asyncio.TaskGroup() as both:
                ended = both.create_task(before.end())
                async with bring(served.url) as ws:
                    await begin(ws, block_vtu(), "my liver.vtu")
                    examined = await said(ws)
                    assert isinstance(examined, Examined)
                    wish = PrepareObject(fix=examined.fix, young=6e3, poisson=0.3)
                    await ws.send(encode_control(wish))
                    answer = await said(ws)
                    while isinstance(answer, Progress):
                        answer = await said(ws)
            assert isinstance(answer, Prepared)
            assert "--young 6000.0 --poisson 0.3" in answer.command
            # By the visitor's own name: where it lies on this machine is nobody's business.
            assert "--body 'my liver.vtu' " in answer.command
            assert str(uploads_folder()) not in answer.command
            code, reason, felt = ended.result()
            assert code == CloseCode.OBJECT_CHANGED.value
            assert "there is another object now" in reason
            # The whole preparation long patches came, a hundred and more a second.
            assert len(felt) > 100
            assert len(felt) > 0.9 * (felt[-1].tick - felt[0].tick)
            async with visit(served.url) as after:
                assert await after.join(next(names)) > number
                assert served.server.room.body.name.startswith("my-liver-")
                await after.play(3)

    runner.run(happen())


def test_an_object_that_cannot_be_opened_leaves_the_one_of_before(
    runner: asyncio.Runner, small_balloon: Balloon
) -> None:
    def fails() -> Body:
        raise CohapticError("there is none")

    async def happen() -> None:
        async with desk_of(small_balloon) as (served, _), visit(served.url) as before:
            await before.join(next(names))
            exchange = served.server.exchange(fails, lambda _: None)
            with pytest.raises(CohapticError, match="there is none"):
                await exchange
            code, _, _ = await before.end()
            assert code == CloseCode.OBJECT_CHANGED.value
            async with visit(served.url) as after:
                await after.join(next(names))
                assert served.server.room.body is small_balloon
                await after.play(3)

    runner.run(happen())


def test_of_ten_at_once_one_is_served(runner: asyncio.Runner, small_balloon: Balloon) -> None:
    async def one(url: str) -> str:
        try:
            async with bring(url) as ws:
                await begin(ws, cube())
                answer = await said(ws)
                await asyncio.sleep(1.0)
                return answer.message if isinstance(answer, Error) else "served"
        except (AssertionError, ConnectionClosed):
            return "too many"

    async def happen() -> None:
        async with desk_of(small_balloon) as (served, desk):
            answers = await asyncio.gather(*(one(served.url) for _ in range(10)))
            assert answers.count("served") == 1
            assert sum("another object is being prepared" in answer for answer in answers) >= 6
            # And then the next one is.
            while desk.busy:
                await asyncio.sleep(0.01)
            async with bring(served.url) as ws:
                await begin(ws, cube())
                assert isinstance(await said(ws), Examined)

    runner.run(happen())


def test_one_who_sends_slowly_or_goes_leaves_nothing_behind(
    runner: asyncio.Runner, small_balloon: Balloon
) -> None:
    async def happen() -> None:
        limits = UploadLimits(receive=0.5)
        async with desk_of(small_balloon, limits) as (served, desk):
            async with bring(served.url) as ws:
                await ws.send(encode_control(BeginUpload(name="a.stl", size=10**6)))
                await ws.send(b"1")
                assert await refusal(ws) == "the file did not come within 0.5 s"
            desk.limits = UploadLimits()  # who sends at once may take as long as it takes
            async with bring(served.url) as ws:
                await ws.send(encode_control(BeginUpload(name="a.stl", size=10**6)))
                await ws.send(b"1")
                while desk.worker is None:
                    await asyncio.sleep(0.01)
                pid = desk.worker.pid
                ws.transport.abort()
            assert await is_gone(pid)
            async with bring(served.url) as ws:
                await begin(ws, cube())
                assert isinstance(await said(ws), Examined)

    runner.run(happen())


def test_a_worker_that_dies_is_one_sentence(runner: asyncio.Runner, small_balloon: Balloon) -> None:
    async def happen() -> None:
        async with desk_of(small_balloon) as (served, desk), stay(served.url) as steady:
            await steady.join(next(names))
            async with bring(served.url) as ws:
                await begin(ws, cube())
                assert isinstance(await said(ws), Examined)
                await ws.send(encode_control(PrepareObject(fix="z < 5%", young=6e3)))
                assert isinstance(await said(ws), Progress)
                assert desk.worker is not None
                os.kill(desk.worker.pid, 9)
                assert await refusal(ws) == "the system ended what reads it"
            await steady.play(3)

    runner.run(happen())


@pytest.mark.parametrize(
    ("messages", "why"),
    [
        ([BeginUpload(name="a.exe", size=10)], "files of kind .exe are not read"),
        ([BeginUpload(name="a", size=10)], r"files of kind \(none\) are not read"),
        ([BeginUpload(name="a.stl", size=2**39)], "the file has 524,288.0 MiB; the limit is 32"),
        ([BeginUpload(name="a.stl", size=10), b"12345678901"], "file is '11 bytes or more'"),
        ([BeginUpload(name="a.stl", size=10), "{}"], "piece of the file is 'none'"),
        ([BeginUpload(name="a.stl", size=10), b""], "piece of the file is 'none'"),
        ([PrepareObject(fix="z", young=1e3)], "message is 'PrepareObject'; expected BeginUpload"),
        ([b"1"], "message is 'bytes'; expected BeginUpload"),
        (["{"], "Invalid JSON"),
        (["x" * 30_000], "control message length is 30000"),
    ],
)
def test_what_breaks_the_rules_is_told(
    messages: list[BeginUpload | PrepareObject | str | bytes],
    why: str,
    runner: asyncio.Runner,
    small_balloon: Balloon,
) -> None:
    async def happen() -> None:
        async with desk_of(small_balloon) as (served, _), bring(served.url) as ws:
            for message in messages:
                if isinstance(message, str | bytes):
                    await ws.send(message)
                else:
                    await ws.send(encode_control(message))
            assert re.search(why, await refusal(ws))

    runner.run(happen())


@pytest.mark.parametrize(
    ("origin", "may"),
    [
        (None, True),
        ("http://{}", True),
        ("http://elsewhere.example", False),
        ("http://localhost:5173", False),
        ("null", False),
    ],
)
def test_only_the_own_page_may_bring_a_file(
    origin: str | None, may: bool, runner: asyncio.Runner, small_balloon: Balloon
) -> None:
    async def happen() -> None:
        async with desk_of(small_balloon) as (served, _):
            named = origin and origin.format(served.url.removeprefix("ws://"))
            refused = contextlib.nullcontext() if may else pytest.raises(InvalidStatus, match="403")
            with refused:
                async with bring(served.url, named):
                    pass

    runner.run(happen())
