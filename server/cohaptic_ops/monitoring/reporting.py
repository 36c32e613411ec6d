"""Route `admin`: reports the metrics of a server with one room to its admin port."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncGenerator

import cohaptic
from cohaptic.room_address import MAIN
from cohaptic_ops.monitoring.admin_port import AdminPort, admin_address
from cohaptic_ops.monitoring.gather import EVERY, Gatherer
from cohaptic_ops.monitoring.lines import RoomLine, ServerLine
from cohaptic_ops.monitoring.metrics import RoomHealth, ServerHealth
from cohaptic_server.routes import Route, Serving
from cohaptic_server.shell.server import CohapticServer

log = logging.getLogger("cohaptic.server")


@contextlib.asynccontextmanager
async def reported(server: CohapticServer, admin: AdminPort) -> AsyncGenerator[None]:
    """Context in which a task reports the metrics of a server to an open admin port."""
    reporting = asyncio.ensure_future(Reporter(server, admin).keep())
    reporting.add_done_callback(_tell_end)
    try:
        yield
    finally:
        reporting.cancel()
        await asyncio.gather(reporting, return_exceptions=True)


def _tell_end(reporting: asyncio.Future[None]) -> None:
    """Log the error if the task that reports to the admin port has failed."""
    if not reporting.cancelled() and (error := reporting.exception()) is not None:
        log.error("nothing is reported to the admin port any more: %r", error, exc_info=error)


@contextlib.asynccontextmanager
async def _open(serving: Serving, text: str) -> AsyncGenerator[str]:
    server = serving.server
    admin = AdminPort(admin_address(text, server.settings.allow_hosts))
    try:
        url = await admin.open()
        async with reported(server, admin):
            yield f"admin port {url}; see it with: cohaptic top {url}"
    finally:
        await admin.close()


ROUTE = Route(_open, check=admin_address)


class Reporter:
    """Reports the health and metrics of a server with one room to an admin port."""

    def __init__(self, server: CohapticServer, admin: AdminPort) -> None:
        self._server, self._admin = server, admin
        self._gatherer = Gatherer(server)

    async def keep(self) -> None:
        """Report every `EVERY` until cancelled, and at once when the server begins to end."""
        ending = self._server.ending
        while True:
            self.report()
            if ending.is_set():
                await asyncio.sleep(EVERY)
            else:
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(EVERY):
                        await ending.wait()

    def report(self) -> None:
        """Send the health of the server and the metrics of its room once."""
        server, name = self._server, self._server.settings.room or MAIN
        sources = server.limiter.sources
        health = ServerHealth(
            version=cohaptic.__version__,
            draining=server.ending.is_set(),
            rooms=(RoomHealth(name=name, state="open"),),
            connections=sources.open,
            refused=sources.refused,
        )
        self._admin.tell(ServerLine(health=health))
        self._admin.tell(RoomLine(room=name, metrics=self._gatherer.gather()))
