"""Runs the process of a server's admin port: starts and restarts it, and sends it reports."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import multiprocessing
import re
import socket
from dataclasses import dataclass
from multiprocessing.process import BaseProcess

from cohaptic.errors import SettingError
from cohaptic_ops.monitoring.admin_process import serve_admin
from cohaptic_ops.monitoring.json_lines import BadLine
from cohaptic_ops.monitoring.lines import (
    LONGEST,
    Line,
    OpenLine,
    RefusedLine,
    decode,
    encode,
)

log = logging.getLogger("cohaptic.server")

_AGAIN = 2.0  # s from the end of a process to the next start; only operators notice the gap
_START = 60.0  # s for a process to open its port on a busy machine


@dataclass(frozen=True, slots=True)
class AdminAddress:
    """Address of the admin port.

    Args:
        port: TCP port; 0 takes any free one.
        host: Address to listen on.
        allow_hosts: Further host names that requests may use.
    """

    port: int
    host: str = "127.0.0.1"
    allow_hosts: tuple[str, ...] = ()


def admin_address(said: str, allow_hosts: tuple[str, ...] = ()) -> AdminAddress:
    """Return the address in a text that consists of a port, or of an address and a port.

    Raises:
        SettingError: The text has neither form.
    """
    host, _, port = said.rpartition(":")
    if not re.fullmatch("[0-9]{1,5}", port) or int(port) > 65535:
        limit = "a port, or an address and a port: 9100 or 127.0.0.1:9100"
        raise SettingError("--admin", repr(said[:60]), limit)
    return AdminAddress(int(port), host.strip("[]") or "127.0.0.1", allow_hosts)


@dataclass(eq=False)
class AdminPort:
    """Admin port of one server, which a separate process serves.

    Attributes:
        address: Address on which the port is opened.
        url: URL of the port after it was opened; empty before.
        process: Running process that serves the port; None if there is none.
    """

    address: AdminAddress
    url: str = ""
    process: BaseProcess | None = None
    _writer: asyncio.StreamWriter | None = None
    _reader: asyncio.StreamReader | None = None
    _keeping: asyncio.Task[None] | None = None

    async def open(self) -> str:
        """Start the process that opens the port; return the URL of the port.

        Raises:
            SettingError: The port is not available.
        """
        await self._start(self.address.port)
        self._keeping = asyncio.ensure_future(self._keep())
        return self.url

    def tell(self, line: Line) -> None:
        """Send a line to the process without waiting; drop it if too many bytes are unread."""
        writer = self._writer
        if writer is None or writer.is_closing():
            return
        if self.unread < LONGEST:
            writer.write(encode(line))

    @property
    def unread(self) -> int:
        """Number of bytes that the process has not read yet."""
        return 0 if self._writer is None else self._writer.transport.get_write_buffer_size()

    async def close(self) -> None:
        """End the process that serves the port."""
        if self._keeping is not None:
            self._keeping.cancel()
        await self._end()

    async def _start(self, port: int) -> None:
        ours, theirs = socket.socketpair()
        # Spawned, not forked, so that the process does not get the server's memory and files.
        context = multiprocessing.get_context("spawn")
        address = self.address
        self.process = context.Process(
            target=serve_admin,
            args=(theirs, address.host, port, address.allow_hosts),
            name="admin port",
            daemon=True,
        )
        await asyncio.to_thread(self.process.start)
        theirs.close()
        ours.setblocking(False)
        self._reader, self._writer = await asyncio.open_connection(sock=ours, limit=LONGEST)
        first: Line | None = None
        with contextlib.suppress(TimeoutError, BadLine, OSError, ValueError):
            async with asyncio.timeout(_START):
                first = decode(await self._reader.readline())
        if isinstance(first, OpenLine):
            self.url = first.url
            for reported in first.missing:
                log.warning("admin port: %s", reported)
            return
        await self._end()
        if isinstance(first, RefusedLine):
            limit = first.limit.replace("--port", "--admin")
            raise SettingError(f"admin {first.name}", first.value, limit)
        raise SettingError("admin port", address.port, "opened by a process, which has ended")

    async def _keep(self) -> None:
        """Start the process again whenever it has ended; never returns."""
        while True:
            if self._reader is not None:
                with contextlib.suppress(OSError):
                    await self._reader.read()
            log.warning("the process of the admin port has ended; it is started again")
            await self._end()
            await asyncio.sleep(_AGAIN)
            port = int(self.url.rpartition(":")[2])
            try:
                await self._start(port)
            except (SettingError, OSError) as error:
                log.warning("the admin port is not there: %s", error)

    async def _end(self) -> None:
        writer, process = self._writer, self.process
        self._writer = self._reader = self.process = None
        if writer is not None:
            writer.close()
        if process is not None:
            process.kill()
            await asyncio.to_thread(process.join)
