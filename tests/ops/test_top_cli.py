"""`cohaptic top`, against real admin ports and against what is none."""

from __future__ import annotations

import asyncio
import http.server
import threading
from collections.abc import Generator

import pytest
import typer
from typer.testing import CliRunner

from cohaptic.errors import ServerLost
from cohaptic_ops.monitoring.admin_port import AdminAddress, AdminPort
from cohaptic_ops.top_cli import read_status, status_address, top
from tests.ops.monitoring.asking import told_until
from tests.ops.monitoring.some import user

pytestmark = pytest.mark.live


def test_once_prints_rooms_and_users_of_a_real_port() -> None:
    app = typer.Typer()
    app.command()(top)

    async def run() -> str:
        port = AdminPort(AdminAddress(0))
        await port.open()
        try:
            await told_until(port, "ready", users=(user(),))
            runner = CliRunner(env={"COLUMNS": "80", "TERM": "dumb"})
            found = await asyncio.to_thread(runner.invoke, app, [port.url, "--once"])
            assert found.exit_code == 0, found.output
            return found.output
        finally:
            await port.close()

    reported = asyncio.run(run())
    assert "main" in reported
    assert "ada" in reported
    assert max(map(len, reported.splitlines())) <= 80


class Other(http.server.BaseHTTPRequestHandler):
    """Another server; says what its path asks for."""

    def do_GET(self) -> None:
        body = {"/null/status": b"null", "/text/status": b"\x1b[2J"}.get(self.path)
        self.send_response(404 if body is None else 200)
        self.end_headers()
        self.wfile.write(body or b"")

    def log_message(self, format: str, *args: object) -> None:
        """Nothing."""


@pytest.fixture
def other() -> Generator[str]:
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Other) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.mark.parametrize("path", ["", "/null", "/text"])
def test_another_server_is_told_as_that(other: str, path: str) -> None:
    with pytest.raises(ServerLost, match="not the admin port of a cohaptic server"):
        read_status(status_address(other + path))
