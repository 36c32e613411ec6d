"""Requests on real sockets: under which names a server is reached."""

from __future__ import annotations

import asyncio
import http.client

import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon
from tests.server.shell.stage import PATIENCE, serving

UPGRADE = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec-WebSocket-Version": "13",
}


def status(url: str, path: str, headers: dict[str, str]) -> tuple[int, str]:
    """Status and text of one answer."""
    connection = http.client.HTTPConnection("127.0.0.1", int(url.rpartition(":")[2]), timeout=10)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    text = "" if answer.status == 101 else answer.read().decode()
    connection.close()
    return answer.status, text


@pytest.mark.parametrize("listens_on", ["127.0.0.1", "0.0.0.0"])
def test_a_name_that_was_made_to_point_here_reads_nothing_and_opens_nothing(
    small_balloon: Balloon, listens_on: str
) -> None:
    async def ask() -> list[tuple[int, str]]:
        names = ("lab.example",)
        async with asyncio.timeout(PATIENCE):
            async with serving(small_balloon, host=listens_on, allow_hosts=names) as served:
                found: list[tuple[int, str]] = []
                for path, headers in requests:
                    found.append(await asyncio.to_thread(status, served.url, path, headers))
                return found

    rebound = {"Host": "rebound.example:8765"}
    own = {"Host": "LAB.example:8765"}
    requests = [
        ("/", rebound),
        ("/v1/models/0/green/0", rebound),
        ("/", {"Host": "a\xadb"}),
        ("/healthz", rebound),
        ("/", own),
        ("/", {"Host": "127.0.0.1"}),
        ("/", UPGRADE | rebound | {"Origin": "http://rebound.example:8765"}),
        ("/", UPGRADE | own | {"Origin": "http://lab.example:8765"}),
    ]
    found = asyncio.run(ask())
    assert [code for code, _ in found] == [421, 421, 421, 200, 200, 200, 403, 101]
    assert found[0][1] == "this server is not known as rebound.example:8765; see --allow-host\n"
    assert found[2][1] == "this server is not known as a?b; see --allow-host\n"
    assert "--allow-host" in found[6][1]
