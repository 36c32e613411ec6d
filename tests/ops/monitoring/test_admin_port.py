"""An admin port as a process of its own, over real sockets."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import sys
from collections.abc import AsyncGenerator

import pytest

from cohaptic.errors import SettingError
from cohaptic_ops.monitoring.admin_port import AdminAddress, AdminPort, admin_address
from tests.ops.monitoring.asking import ask, status_once, told_until
from tests.ops.monitoring.some import health, room

pytestmark = pytest.mark.live


@contextlib.asynccontextmanager
async def opened(*allow_hosts: str) -> AsyncGenerator[AdminPort]:
    port = AdminPort(AdminAddress(0, allow_hosts=allow_hosts))
    try:
        await port.open()
        yield port
    finally:
        await port.close()


def pid(port: AdminPort) -> int:
    assert port.process is not None
    assert port.process.pid is not None
    return port.process.pid


@pytest.mark.skipif(sys.platform == "win32", reason="kills as POSIX does")
def test_it_answers_only_its_own_names_and_comes_back_when_it_is_killed() -> None:
    async def run() -> None:
        async with opened("metrics.example") as port:
            reported = await told_until(port, "ready")
            assert reported["rooms"][0]["name"] == "main"
            # A page whose name was made to point here reads nothing; a scraper's name is said.
            assert (await ask(f"{port.url}/status", Host="evil.example"))[0] == 421
            assert (await ask(f"{port.url}/metrics", Host="metrics.example"))[0] == 200
            wanted = {"Upgrade": "websocket", "Connection": "Upgrade"}
            assert (await ask(f"{port.url}/status", **wanted))[0] in (200, 426)
            url, first = port.url, pid(port)
            os.kill(first, signal.SIGKILL)
            port.tell(health())  # to nobody, which hurts nobody
            await status_once(url, lambda reported: not reported["alive"])
            assert pid(port) != first
            assert (await told_until(port, "alive"))["rooms"]
            again = pid(port)
        with pytest.raises(ProcessLookupError):
            os.kill(again, 0)

    asyncio.run(run())


def test_a_port_that_is_taken_is_a_sentence_that_names_the_option() -> None:
    async def run() -> None:
        async with opened() as port:
            taken = int(port.url.rpartition(":")[2])
            with pytest.raises(SettingError, match=rf"admin port is {taken}, .* --admin"):
                await AdminPort(AdminAddress(taken)).open()
            assert (await ask(f"{port.url}/"))[0] == 200

    asyncio.run(run())


@pytest.mark.skipif(sys.platform == "win32", reason="stops as POSIX does")
def test_lines_that_nobody_reads_take_a_bounded_memory() -> None:
    async def run() -> None:
        async with opened() as port:
            os.kill(pid(port), signal.SIGSTOP)
            try:
                line = room(refused={f"cause {i}": i for i in range(1000)})
                for _ in range(1000):
                    port.tell(line)
                assert 0 < port.unread < 2**20
            finally:
                os.kill(pid(port), signal.SIGCONT)
            # What is newest is told as soon as there is room for it.
            for _ in range(200):
                port.tell(health())
                await asyncio.sleep(0.05)
                if json.loads((await ask(f"{port.url}/status"))[1])["alive"]:
                    return
            raise AssertionError("it never heard of the server again")

    asyncio.run(run())


def test_an_address_is_a_port_or_an_address_and_a_port() -> None:
    assert admin_address("9100") == AdminAddress(9100, "127.0.0.1")
    assert admin_address("0.0.0.0:9100").host == "0.0.0.0"
    assert admin_address("[::1]:0") == AdminAddress(0, "::1")
    for wrong in ("", "x", "1:2:x", "-1", "65536", "127.0.0.1:", "9100\n", "٣"):
        with pytest.raises(SettingError, match="--admin"):
            admin_address(wrong)
