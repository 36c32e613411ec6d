"""A path between a client and a server that can be cut, or swallow everything for a while."""

from __future__ import annotations

import contextlib
import select
import socket
import struct
import threading

_BUFFER = 65536  # bytes; more than is on its way while nothing passes for a few seconds


class BrokenPath:
    """Passes on what connections say, in a thread.

    Args:
        port: Of the server.

    Attributes:
        url: Of this end.
        passes: Whether anything passes; as where a cable is out, nobody is told.
        takes: Whether newcomers are let in; else they wait at the acceptor.
    """

    def __init__(self, port: int) -> None:
        self._target = ("127.0.0.1", port)
        self._acceptor = socket.create_server(("127.0.0.1", 0))
        self.url = f"ws://127.0.0.1:{self._acceptor.getsockname()[1]}"
        self.passes = self.takes = True
        self._ends: dict[socket.socket, socket.socket] = {}
        self._cut = self._over = False
        self._thread = threading.Thread(target=self._pass, daemon=True)
        self._thread.start()

    def cut(self) -> None:
        """End every connection in both directions, without a farewell."""
        self._cut = True

    def close(self) -> None:
        """End everything."""
        self._cut = self._over = True
        self._thread.join()
        self._acceptor.close()

    def _pass(self) -> None:
        while not self._over or self._cut:
            if self._cut:
                for end in list(self._ends):
                    # A reset, as of a machine that knows of no such connection.
                    linger = struct.pack("ii", 1, 0)
                    end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
                    self._end(end)
                self._cut = False
            acceptor = [self._acceptor] if self.takes else []
            waiting = [*acceptor, *self._ends] if self.passes else []
            for ready in select.select(waiting, [], [], 0.002)[0]:
                if ready is self._acceptor:
                    self._take()
                elif ready in self._ends:
                    self._pass_on(ready)

    def _take(self) -> None:
        near, _ = self._acceptor.accept()
        far = socket.create_connection(self._target)
        for end in (near, far):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._ends |= {near: far, far: near}

    def _pass_on(self, end: socket.socket) -> None:
        try:
            data = end.recv(_BUFFER)
            if data:
                self._ends[end].sendall(data)
                return
        except OSError:
            pass
        other = self._ends.get(end)
        self._end(end)
        if other is not None:
            self._end(other)

    def _end(self, end: socket.socket) -> None:
        self._ends.pop(end, None)
        with contextlib.suppress(OSError):
            end.close()
