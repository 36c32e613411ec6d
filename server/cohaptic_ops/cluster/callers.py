"""Serves the connections of other nodes: their questions, and connections that they pass on."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from collections.abc import Callable
from typing import cast

from cohaptic_ops.cluster.lines import LONGEST, Answer, Ask, Pass, decode, encode
from cohaptic_ops.cluster.passing import notice_end
from cohaptic_ops.monitoring.json_lines import BadLine

log = logging.getLogger("cohaptic.server")


class Caller(asyncio.Protocol):
    """A connection of another node.

    Args:
        answer: Answers a question.
        take: Takes a connection that the other node passes on, or leaves it to be closed.
    """

    def __init__(
        self, answer: Callable[[Ask], Answer], take: Callable[[socket.socket, Pass], None]
    ) -> None:
        self._answer, self._take = answer, take
        self._rest = b""
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Store the transport; the event loop calls this at the beginning."""
        self._transport = cast("asyncio.Transport", transport)
        notice_end(self._transport.get_extra_info("socket"))

    def data_received(self, data: bytes) -> None:
        """Answer the lines of the other node; the event loop calls this."""
        assert self._transport is not None
        *lines, self._rest = (self._rest + data).split(b"\n")
        try:
            if len(self._rest) > LONGEST:
                raise BadLine("a line without an end")
            for line in lines:
                match decode(line):
                    case Ask() as ask:
                        self._transport.write(encode(self._answer(ask)))
                    case Pass() as words:
                        self._hand_on(words)
                        return
                    case _:
                        raise BadLine("an answer without a question")
        except BadLine as error:
            log.warning("another node sent a wrong line: %s", error, extra={"event": "bad_node"})
            self._transport.abort()

    def _hand_on(self, words: Pass) -> None:
        """Hand the socket to a room; nothing of the visitor was sent before it is accepted."""
        assert self._transport is not None
        handle: socket.socket = self._transport.get_extra_info("socket")
        self._transport.pause_reading()
        connection = socket.socket(fileno=os.dup(handle.fileno()))
        with connection:
            self._transport.abort()  # closes its own descriptor only
            connection.setblocking(False)
            self._take(connection, words)
