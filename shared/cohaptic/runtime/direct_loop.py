"""An event loop that serves a socket and a timer without asyncio's handles, to save time.

A process that wakes 120 times a second for a few microseconds of work finds cold caches each time;
its cost then grows with the number of different instructions. Asyncio's work between two `select`
calls took half the time of a client's network process. In this loop callbacks within `select` serve
the socket and the timer directly; asyncio runs only when a callback gives it something to do.
Everything else is asyncio's own loop.
"""

from __future__ import annotations

import asyncio
import select
import selectors
import socket
from collections.abc import Callable
from contextvars import Context
from math import inf
from typing import Any, TypeVarTuple, Unpack

_Arguments = TypeVarTuple("_Arguments")
_READ = 1 << 15  # bytes read at once; further bytes wait in the kernel for the next round


class _DirectSelector(selectors.SelectSelector):
    """A `select` selector that also serves sockets and a timer by callbacks.

    Args:
        time: Function that reads the clock of the event loop [s].

    Attributes:
        roused: Whether asyncio has been given something to do since `select` began.
        when: Time of the timer on the clock of the event loop [s]; infinite for no timer.
        call: Function that the timer calls; must not raise.
    """

    def __init__(self, time: Callable[[], float]) -> None:
        super().__init__()
        self._time = time
        self.roused = False
        self.when = inf
        self.call: Callable[[], None] = _nothing
        self._direct: dict[int, _Reader] = {}
        self._reading: list[int] = []
        self._any_writing = False

    def read_directly(self, fd: int, reader: _Reader) -> None:
        """Let `reader` read the file `fd` until asyncio stops reading that file."""
        self._drop(fd)
        self._direct[fd] = reader

    def register(self, fileobj: Any, events: int, data: Any = None) -> selectors.SelectorKey:
        """As in `selectors`."""
        key = super().register(fileobj, events, data)
        self._look()
        return key

    def unregister(self, fileobj: Any) -> selectors.SelectorKey:
        """As in `selectors`; also end direct reading of the file."""
        key = super().unregister(fileobj)
        self._drop(key.fd)
        self._look()
        return key

    def modify(self, fileobj: Any, events: int, data: Any = None) -> selectors.SelectorKey:
        """As in `selectors`."""
        fd = self.get_key(fileobj).fd
        reader = self._direct.pop(fd, None)  # the library may modify by `unregister`
        key = super().modify(fileobj, events, data)
        if reader is not None:
            self._direct[fd] = reader
            if not events & selectors.EVENT_READ:
                self._drop(fd)
        self._look()
        return key

    def close(self) -> None:
        """As in `selectors`; also close the duplicate sockets of the direct readers."""
        for fd in list(self._direct):
            self._drop(fd)
        super().close()

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Wait for events and return the files that asyncio has to serve.

        The list is empty after the time-out, or if a callback has given asyncio something to do.
        """
        self.roused = False
        end = inf if timeout is None else self._time() + timeout
        while True:
            now = self._time()
            if self.when <= now:
                self.when = inf
                self.call()
                if self.roused:
                    return []
                continue
            until = min(end, self.when)
            wait = None if until == inf else max(0.0, until - now)
            if self._any_writing:
                return super().select(wait)
            ready = select.select(self._reading, (), (), wait)[0]
            if not self._serve(ready):
                keys = [self.get_map().get(fd) for fd in ready]  # a reader may have closed another
                return [(key, selectors.EVENT_READ) for key in keys if key is not None]
            if self.roused or self._time() >= end:
                return []

    def _serve(self, ready: list[int]) -> bool:
        """Read the ready files if all have direct readers; return False if asyncio must read."""
        for fd in ready:
            if fd not in self._direct:
                return False
        for fd in ready:
            reader = self._direct.get(fd)  # the previous reader may have closed this one
            if reader is not None and not reader.read():
                self._drop(fd)
                return False
        return True

    def _drop(self, fd: int) -> None:
        reader = self._direct.pop(fd, None)
        if reader is not None:
            reader.socket.close()

    def _look(self) -> None:
        keys = list(self.get_map().values())
        self._reading = [key.fd for key in keys if key.events & selectors.EVENT_READ]
        self._any_writing = any(key.events & selectors.EVENT_WRITE for key in keys)


def _nothing() -> None:
    pass


class _Reader:
    """Direct reader of a transport's socket.

    Args:
        loop: Event loop that reports errors.
        transport: Owner of the socket; the reader aborts it when `take` raises.
        take: Function that the reader calls with the bytes received.

    Attributes:
        socket: Duplicate of the socket, since the transport's own cannot be read from outside.
            Close the duplicate with the transport's socket: the connection lasts as long as either
            is open.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        transport: asyncio.Transport,
        take: Callable[[bytes], None],
    ) -> None:
        self.socket: socket.socket = transport.get_extra_info("socket").dup()
        self._loop, self._transport, self._take = loop, transport, take

    def read(self) -> bool:
        """Read once; return False at the end of the stream or an error, for asyncio to handle."""
        try:
            data = self.socket.recv(_READ)
        except (BlockingIOError, InterruptedError):
            return True
        except OSError:
            return False
        if data:
            try:
                self._take(data)
            except Exception as error:
                self._transport.abort()
                context = {"message": "a protocol failed", "exception": error}
                self._loop.call_exception_handler(context)
        return bool(data)


class DirectLoop(asyncio.SelectorEventLoop):
    """asyncio's event loop, which also serves sockets and one timer directly within `select`."""

    def __init__(self) -> None:
        self._direct = _DirectSelector(self.time)
        super().__init__(self._direct)

    # Work given to asyncio within a direct callback must not wait for the next event.

    def call_soon(
        self,
        callback: Callable[[Unpack[_Arguments]], object],
        *args: *_Arguments,
        context: Context | None = None,
    ) -> asyncio.Handle:
        """As in asyncio."""
        self._direct.roused = True
        return super().call_soon(callback, *args, context=context)

    def call_at(
        self,
        when: float,
        callback: Callable[[Unpack[_Arguments]], object],
        *args: *_Arguments,
        context: Context | None = None,
    ) -> asyncio.TimerHandle:
        """As in asyncio."""
        self._direct.roused = True
        return super().call_at(when, callback, *args, context=context)

    def set_direct_timer(self, when: float, call: Callable[[], None]) -> None:
        """Set the direct timer of the loop; the new timer replaces the previous one.

        Args:
            when: Time of the call on this loop's clock [s]; the call may come a moment later.
            call: Function to call. It must be short; an exception that it raises ends the loop.
        """
        self._direct.when, self._direct.call = when, call

    def cancel_direct_timer(self) -> None:
        """Cancel the direct timer of the loop."""
        self.set_direct_timer(inf, _nothing)

    def read_directly(self, transport: asyncio.Transport, take: Callable[[bytes], None]) -> bool:
        """Let the loop pass received bytes to a transport's protocol without asyncio's handles.

        The transport still handles the end of the stream, errors and all writing.

        Args:
            transport: Open transport. Nothing changes for an encrypted one.
            take: `data_received` of the protocol; an exception aborts the transport.

        Returns:
            Whether the loop reads this transport directly from now on.
        """
        if transport.get_extra_info("sslcontext") is not None:
            return False
        reader = _Reader(self, transport, take)
        self._direct.read_directly(transport.get_extra_info("socket").fileno(), reader)
        return True
