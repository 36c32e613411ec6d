"""Requests on real sockets: names of the server, and bodies that are exchanged meanwhile."""

from __future__ import annotations

import asyncio
import http.client
import json
import logging
from urllib.parse import urlsplit

import pytest

from cohaptic_server.bodies.balloon.balloon import Balloon
from tests.patience import PATIENCE
from tests.server.shell.stage import serving

pytestmark = pytest.mark.live

UPGRADE = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec-WebSocket-Version": "13",
}


def status(url: str, path: str, headers: dict[str, str]) -> tuple[int, str]:
    """Status and text of one answer."""
    connection = http.client.HTTPConnection(
        "127.0.0.1", int(url.rpartition(":")[2]), timeout=PATIENCE
    )
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


async def get(url: str, path: str) -> str:
    """The answer in one text."""
    at = urlsplit(url)
    reader, writer = await asyncio.open_connection(at.hostname, at.port)
    writer.write(f"GET {path} HTTP/1.1\r\nHost: {at.netloc}\r\n\r\n".encode())
    answer = await asyncio.wait_for(reader.read(), PATIENCE)
    writer.close()
    return answer.decode("latin-1")


def test_a_byte_that_no_header_can_hold_ends_in_no_fault(small_balloon: Balloon) -> None:
    async def ask() -> str:
        async with asyncio.timeout(PATIENCE), serving(small_balloon) as served:
            return await get(served.url, "/r/main?\x00")

    answer = asyncio.run(ask())
    assert answer.startswith("HTTP/1.1 307 ")
    assert "\r\nLocation: main/?%00\r\n" in answer


def test_no_answer_and_no_log_repeats_a_token_that_came_in_an_address(
    small_balloon: Balloon, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG, "cohaptic")
    wrong = ["/r/main?x=1&token=SECRET", "/?token=SECRET", "/r/main/?token=SECRET"]
    wrong += ["/r/none?token=SECRET", "/none?token=SECRET", "/v1/hosts?token=SECRET"]

    async def ask() -> list[str]:
        async with asyncio.timeout(PATIENCE), serving(small_balloon) as served:
            return [await get(served.url, path) for path in wrong]

    answers = asyncio.run(ask())
    assert "\r\nLocation: main/?x=1&token=\r\n" in answers[0]
    assert "SECRET" not in "".join(answers)
    assert "SECRET" not in caplog.text


@pytest.mark.parametrize("listens_on", ["127.0.0.1", "0.0.0.0"])
def test_only_this_machines_own_page_hears_where_others_reach_the_server(
    small_balloon: Balloon, listens_on: str
) -> None:
    async def ask(headers: dict[str, str]) -> tuple[int, str]:
        async with asyncio.timeout(PATIENCE):
            async with serving(
                small_balloon, host=listens_on, allow_hosts=("lab.example",)
            ) as served:
                return await asyncio.to_thread(status, served.url, "/v1/hosts", headers)

    code, answer = asyncio.run(ask({"Host": "localhost:8765"}))
    hosts = json.loads(answer)["hosts"]
    if listens_on == "127.0.0.1":
        assert (code, hosts) == (200, [])
    else:
        assert (code, hosts[0]) == (200, "lab.example")
        assert not {"0.0.0.0", "127.0.0.1"} & set(hosts)
    assert asyncio.run(ask({"Host": "lab.example:8765"}))[0] == 404
