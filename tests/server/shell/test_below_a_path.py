"""A server below a path of a proxy, and addresses that lead to no room.

`deploy/nginx.conf` is played, with a path in place of the root; it keeps the path, or takes it off.
"""

from __future__ import annotations

import asyncio
import contextlib
import http.client
import json
import ssl
import sys
from pathlib import Path
from typing import Any
from urllib.parse import urljoin, urlsplit

import pytest
from websockets.exceptions import ConnectionClosed

from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import Welcome, encode_control
from cohaptic_server.access.admission import Admission
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.guard.limits import Budget, Limits
from cohaptic_server.shell.limiter import Protection
from tests.patience import PATIENCE
from tests.server.access.some import RING
from tests.server.credentials.pairs import write_authority
from tests.server.peers import hello
from tests.server.shell.nginx import NEEDS_NGINX, proxied
from tests.server.shell.stage import serving, visit

pytestmark = [pytest.mark.live, NEEDS_NGINX]

NO_ROOM = CloseCode.NO_ROOM.value


async def comes(url: str, **options: Any) -> int:
    """How a visit to an address ends: 0 in the room, or with the code of a refusal."""
    async with visit(url, **options) as client:
        with contextlib.suppress(ConnectionClosed):
            await client.ws.send(encode_control(hello("left")))
            if isinstance(await client.hear(), Welcome):
                return 0
        return (await client.end())[0]


def page(port: int, path: str, trust: ssl.SSLContext) -> tuple[int, str]:
    """Status of an address, and where it led to."""
    asking = http.client.HTTPSConnection("127.0.0.1", port, timeout=PATIENCE, context=trust)
    with contextlib.closing(asking):
        asking.request("GET", path, headers={"Host": f"lab.example:{port}"})
        answer = asking.getresponse()
        answer.read()
    if answer.status not in (301, 307):
        return answer.status, path
    led = urlsplit(urljoin(path, answer.headers["Location"]))
    return page(port, f"{led.path}?{led.query}" if led.query else led.path, trust)


@pytest.mark.parametrize("keeps", [True, False], ids=["path kept", "path taken off"])
@pytest.mark.parametrize("base", ["", "/haptics"])
@pytest.mark.parametrize("location", ["/haptics/", "/haptics"])
def test_page_stream_and_rooms_are_found_below_a_path_or_refused_and_never_another_room(
    small_balloon: Balloon, tmp_path: Path, keeps: bool, base: str, location: str
) -> None:
    # nginx puts what is behind `location` in place of it: without a slash there, two are left.
    works = location == "/haptics/" if not keeps else bool(base)
    changes = [("location /", f"location {location}")]
    if not keeps:
        changes.append(("proxy_pass http://cohaptic;", "proxy_pass http://cohaptic/;"))

    async def run() -> None:
        trust = ssl.create_default_context(cafile=str(write_authority(tmp_path)))
        names = ("lab.example",)
        async with serving(small_balloon, allow_hosts=names, base_path=base) as served:
            with proxied(served.url, tmp_path, *changes) as port:

                async def through(path: str) -> int:
                    url = f"wss://lab.example:{port}{path}"
                    return await comes(url, ssl=trust, host="127.0.0.1", port=port)

                for path in ("/haptics/", "/haptics/r/main", "/haptics/r/main/"):
                    assert await through(path) == (0 if works else NO_ROOM), path
                for path in (
                    "/haptics/r/liver",
                    "/haptics/R/main",
                    "/haptics//r/liver",
                    "/haptics/r/",
                ):
                    assert await through(path) == NO_ROOM, path
                if not works:
                    return
                for path, led in (
                    ("/haptics?view=all", "/haptics/?view=all"),
                    ("/haptics/r/main", "/haptics/r/main/"),
                    ("/haptics/healthz", "/haptics/healthz"),
                ):
                    assert await asyncio.to_thread(page, port, path, trust) == (200, led)
                found = await asyncio.to_thread(page, port, "/haptics/r/liver/", trust)
                assert found[0] == 404
                assert await touches(f"wss://127.0.0.1:{port}/haptics", tmp_path)
                assert await touches(f"https://127.0.0.1:{port}/haptics/", tmp_path, "main")
                assert not await touches(f"wss://127.0.0.1:{port}/haptics", tmp_path, "liver")

    asyncio.run(run())


async def touches(url: str, folder: Path, room: str = "") -> bool:
    """Whether `cohaptic touch` comes into a room at an address, or ends."""
    command = ("touch", url, "--name", "right", "--room", room, "--json-lines", "--lifeline")
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "cohaptic", *command, "--ca-file", str(write_authority(folder)),
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
    )  # fmt: skip
    assert process.stdin is not None
    assert process.stdout is not None
    async with asyncio.timeout(PATIENCE):
        while line := await process.stdout.readline():
            if json.loads(line)["state"] in ("touching", "free"):
                break
        process.stdin.close()
        await process.communicate()
    return bool(line)


def test_an_address_that_is_no_rooms_leads_to_none(small_balloon: Balloon) -> None:
    async def run() -> None:
        async with serving(small_balloon, base_path="/haptics") as served:
            for path in ("", "/", "/?name=ann", "/r/main", "/haptics", "/haptics/?a=/r/b"):
                assert await comes(served.url + path) == 0, path
            for path in (
                "/haptics/r/liver", "/haptics/r/nosuch/", "/R/main", "//r/main", "/r/main/r/liver",
                "/r", "/%72/main", "/./r/main", "/main", "/other/", "/Haptics/", "/hapticsr/main",
                "/haptics/haptics/", "//haptics/", "/r/MAIN", "/r/" + "a" * 3000,
            ):  # fmt: skip
                assert await comes(served.url + path) == NO_ROOM, path

    asyncio.run(run())


def test_the_way_to_the_slash_repeats_no_token_and_costs_its_visitor(
    small_balloon: Balloon,
) -> None:
    few = Limits(connections=Budget(0.001, 3.0))
    behind = Protection(Admission(RING, admits_anybody=True), proxies=("127.0.0.1",))

    def answers(port: int, source: str) -> list[tuple[int, str | None]]:
        found = list[tuple[int, str | None]]()
        for _ in range(4):
            asking = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
            with contextlib.closing(asking):
                headers = {"X-Forwarded-For": source}
                asking.request("GET", "/haptics?token=secret&view=all", headers=headers)
                answer = asking.getresponse()
                assert b"secret" not in answer.read()
                found.append((answer.status, answer.headers["Location"]))
        return found

    async def run() -> None:
        async with serving(
            small_balloon, base_path="/haptics", protection=behind, limits=few
        ) as served:
            port = urlsplit(served.url).port
            assert port is not None
            for source in ("9.9.9.9", "9.9.9.8"):
                led = await asyncio.to_thread(answers, port, source)
                assert led[:3] == 3 * [(307, "haptics/?token=&view=all")]
                assert led[3] == (429, None)

    asyncio.run(run())
