"""Green's functions of a body that is exchanged while somebody waits for them."""

from __future__ import annotations

import asyncio
import threading
from urllib.parse import urlsplit

from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.spring import Spring
from cohaptic_server.http.green_functions import encode_block, green_source
from tests.server.shell.stage import serving

PATIENCE = 30.0  # s


async def get(url: str, path: str) -> str:
    """The answer in one text."""
    at = urlsplit(url)
    reader, writer = await asyncio.open_connection(at.hostname, at.port)
    writer.write(f"GET {path} HTTP/1.1\r\nHost: {at.netloc}\r\n\r\n".encode())
    answer = await asyncio.wait_for(reader.read(), PATIENCE)
    writer.close()
    return answer.decode("latin-1")


def test_each_request_is_answered_though_the_body_is_another(small_balloon: Balloon) -> None:
    source = green_source(small_balloon)
    assert source is not None
    began, allowed = threading.Event(), threading.Event()

    def solve(vertex: int) -> bytes:
        began.set()
        assert allowed.wait(PATIENCE)
        return encode_block(source.green(vertex))

    async def happen() -> None:
        async with serving(small_balloon) as served:
            web = served.server.web
            web.serve(small_balloon, solve)
            path = f"/v1/models/{web.model}/green/"
            first = asyncio.ensure_future(get(served.url, f"{path}0"))
            assert await asyncio.to_thread(began.wait, PATIENCE)
            second = asyncio.ensure_future(get(served.url, f"{path}1"))
            # The request waits in the queue before it can be cancelled there.
            while web.waiting < 2:
                await asyncio.sleep(0)
            web.serve(Spring(), None)
            allowed.set()
            assert (await first).startswith("HTTP/1.1 200 ")
            assert "404 Not Found" in await second
            assert "there is no such model here" in await second

    asyncio.run(happen())
