"""A recorded session over real sockets: what its page asks for, and what nobody gets."""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from cohaptic.clock import SystemClock
from cohaptic.sessions.replay import Replay, vertices_and_faces
from cohaptic_server.objects.recorded_body import recorded_body
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.limiter import ConnectionLimiter
from cohaptic_server.shell.session_web import SessionWeb
from tests.patience import PATIENCE
from tests.recorded_sessions import record
from tests.server.shell.test_http import UPGRADE, status

pytestmark = pytest.mark.live


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Replay:
    return Replay.of(record(tmp_path_factory.mktemp("session") / "lab.mcap", 2.0))


@asynccontextmanager
async def served(replay: Replay) -> AsyncGenerator[str]:
    settings = ServerSettings(port=0)
    body, unshown = recorded_body(replay.info.settings, replay.watching.body, replay.mesh)
    limiter = ConnectionLimiter(settings.limits, SystemClock())
    web = SessionWeb(replay, body, unshown, settings, limiter)
    listener, url = await web.listen()
    try:
        yield url
    finally:
        web.close()
        listener.close()
        await listener.wait_closed()


def test_a_page_gets_all_of_a_session_and_nobody_comes_in(opened: Replay) -> None:
    async def ask() -> None:
        async with asyncio.timeout(PATIENCE), served(opened) as url:

            async def get(path: str, headers: dict[str, str] | None = None) -> tuple[int, str]:
                return await asyncio.to_thread(status, url, path, headers or {})

            assert (await get("/"))[0] == 307
            assert (await get("/?session"))[0] == 200
            assert (await get("/healthz"))[0] == 200
            code, text = await get("/session.json")
            told = json.loads(text)
            assert (code, told["name"], told["unshown"]) == (200, "lab.mcap", "")
            model = json.loads(told["watching"])["model"]
            assert (await get("/session/scenes?from=0&to=99"))[0] == 400
            assert (await get(f"/session/scenes?from={opened.last + 9}&to={opened.last + 10}"))[
                0
            ] == 200
            _, text = await get(f"/session/why?user=1&t={opened.first + 1.0}")
            assert json.loads(text)["sentence"].startswith("The hand was given")
            assert await get("/session/why?user=1&t=1") == (200, "null")
            code, text = await get("/v1/models/0/green/0")
            assert (code, f"the body's is {model}" in text) == (404, True)
            code, text = await get("/", UPGRADE)
            assert code == 404
            assert "nobody can touch it" in text
            # A page whose name was made to point here reads nothing.
            rebound = {"Host": "rebound.example:8765"}
            assert (await get("/session.json", rebound))[0] == 421
            assert (await get(f"/session/why?user=1&t={opened.first}", rebound))[0] == 421

    asyncio.run(ask())


def test_scenes_and_green_functions_come_as_bytes(opened: Replay) -> None:
    async def ask() -> None:
        async with asyncio.timeout(PATIENCE), served(opened) as url:
            port = int(url.rpartition(":")[2])

            async def get(path: str) -> bytes:
                reader, writer = await asyncio.open_connection("127.0.0.1", port)
                writer.write(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
                answer = await reader.read()
                writer.close()
                return answer.partition(b"\r\n\r\n")[2]

            first = opened.first
            scenes = await get(f"/session/scenes?from={first}&to={first + 1.0}")
            assert scenes == opened.scenes(first, first + 1.0)
            assert struct.unpack_from("<d", scenes) == (first + 1.0,)
            assert await get("/session/mesh") == opened.mesh
            told = json.loads(await get("/session.json"))
            model = json.loads(told["watching"])["model"]
            blocks = await get(f"/v1/models/{model}/green/0,7")
            vertices, _ = vertices_and_faces(opened.mesh)
            assert len(blocks) == 2 * (4 + 18 * len(vertices))
            assert await get(f"/v1/models/{model}/green/7") == blocks[len(blocks) // 2 :]

    asyncio.run(ask())


def test_a_file_that_goes_away_is_told_in_words(tmp_path: Path) -> None:
    async def ask() -> None:
        path = record(tmp_path / "gone.mcap", 1.0)
        replay = Replay.of(path)
        async with asyncio.timeout(PATIENCE), served(replay) as url:
            path.unlink()
            target = f"/session/scenes?from={replay.first}&to={replay.last}"
            code, text = await asyncio.to_thread(status, url, target, {})
            assert code == 400
            assert "it must be a file to read (No such file" in text

    asyncio.run(ask())
