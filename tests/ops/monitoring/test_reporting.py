"""A server that reports itself: what really happens in it is what is told."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncGenerator

import pytest

from cohaptic_ops.monitoring.reporting import ROUTE
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.routes import Serving
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.server import CohapticServer
from tests.ops.monitoring.asking import ask, status_once
from tests.server.peers import hello_text
from tests.server.shell.stage import visit

pytestmark = pytest.mark.live


@contextlib.asynccontextmanager
async def telling(server: CohapticServer) -> AsyncGenerator[str]:
    """Address of its admin port, as long as it is open."""
    async with ROUTE.open(Serving(server, ServedBody(server.room.body)), "0") as line:
        yield line.split()[2].rstrip(";")


def test_what_happens_in_a_server_is_told_by_its_admin_port(small_balloon: Balloon) -> None:
    async def run() -> None:
        server = CohapticServer(small_balloon, ServerSettings(port=0, max_users=2))
        async with telling(server) as admin:
            url = await server.start()
            running = asyncio.ensure_future(server.run())
            try:
                await status_once(admin, lambda status: bool(status["ready"]))
                async with visit(url) as one, visit(url) as other, visit(url) as third:
                    await one.join("ada")
                    await other.join("<b> \u0301")
                    one.probe, one.force = (0.09, 0.0, 0.0), (2.0, 0.0, 0.0)
                    await one.play(30)
                    await third.ws.send(hello_text("too many"))
                    with contextlib.suppress(Exception):
                        while True:
                            await third.ws.recv()
                    playing = asyncio.ensure_future(one.play(100_000))
                    status = await status_once(
                        admin,
                        lambda status: (
                            status["rooms"][0]["metrics"]["refused"].get("room_full") == 1
                            and status["rooms"][0]["metrics"]["users"][0]["force"] > 0.5
                        ),
                    )
                    metrics = status["rooms"][0]["metrics"]
                    first, second = metrics["users"]
                    assert (first["name"], first["seat"]) == ("ada", 1)
                    assert (second["name"], second["seat"]) == ("<b> \u0301", 2)
                    assert second["delay"] is None
                    assert 0.0 < first["delay"] < 10.0
                    unmade = metrics["left_out"] + metrics["slept"]
                    assert sum(metrics["cost"]["counts"]) == metrics["ticks"] - unmade
                    assert metrics["received"] > 30 * 44
                    assert metrics["sent"] > 30 * 104
                    assert metrics["connections"] >= 2
                    playing.cancel()
                # A seat that has become free is the next one's.
                async with visit(url) as late:
                    await late.join("late")
                    status = await status_once(
                        admin,
                        lambda status: (
                            [u["name"] for u in status["rooms"][0]["metrics"]["users"]] == ["late"]
                        ),
                    )
                    assert status["rooms"][0]["metrics"]["users"][0]["seat"] == 1
                    # Who is there holds up the end, and meanwhile nobody is sent here.
                    running.cancel()
                    await status_once(admin, lambda status: bool(status["draining"]))
                    assert (await ask(f"{admin}/readyz"))[0] == 503
            finally:
                running.cancel()
                with contextlib.suppress(asyncio.CancelledError):
                    await running

    asyncio.run(run())
