"""Tells an admin port of a server with one room."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

import cohaptic
from cohaptic.room_address import MAIN
from cohaptic_server.monitoring.admin_port import AdminPort
from cohaptic_server.monitoring.gather import EVERY, Gatherer
from cohaptic_server.monitoring.lines import RoomLine, ServerLine
from cohaptic_server.monitoring.metrics import RoomHealth, ServerHealth
from cohaptic_server.shell.server import CohapticServer


async def run_reported(
    server: CohapticServer, before_tick: Callable[[], None] | None, admin: AdminPort
) -> None:
    """Run a server as it runs by itself, and report it until the last client has gone.

    Args:
        server: That has been started.
        before_tick: As of `CohapticServer.run`.
        admin: Where to.
    """
    reporter = Reporter(server, admin)
    reporting = asyncio.ensure_future(reporter.keep())
    running = asyncio.ensure_future(server.run(before_tick))
    try:
        await asyncio.shield(running)
    except asyncio.CancelledError:
        reporter.draining = True
        reporter.report()
        running.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await running
        raise
    finally:
        reporting.cancel()


class Reporter:
    """Reports on one server with one room.

    Args:
        server: That is read.
        admin: That is told.

    Attributes:
        draining: Whether the server is about to end.
    """

    def __init__(self, server: CohapticServer, admin: AdminPort) -> None:
        self._server, self._admin = server, admin
        self._gatherer = Gatherer(server)
        self.draining = False

    async def keep(self) -> None:
        """Report until cancelled."""
        while True:
            self.report()
            await asyncio.sleep(EVERY)

    def report(self) -> None:
        """Report once."""
        server, name = self._server, self._server.settings.room or MAIN
        sources = server.gate.sources
        health = ServerHealth(
            version=cohaptic.__version__,
            draining=self.draining,
            rooms=(RoomHealth(name=name, state="open"),),
            connections=sources.open,
            refused=sources.refused,
        )
        self._admin.tell(ServerLine(health=health))
        self._admin.tell(RoomLine(room=name, metrics=self._gatherer.gather()))
