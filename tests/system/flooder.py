"""Floods, in a process of their own: `python -m tests.system.flooder`.

A line of standard input names a flood and the server; the next line, whatever it is, ends it.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import random
import socket
import sys
import threading
from collections.abc import Callable

from websockets.frames import Frame, Opcode

from cohaptic.control.law import Law
from cohaptic.protocol.messages import SetLaw, encode_control
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic.protocol.websocket_frames import make_frame
from tests.server.peers import hello_text, sample
from tests.server.shell.stage import FAR, REQUEST, ZERO

KEY = b"abcd"
PING = Frame(Opcode.PING, b"x" * 8).serialize(mask=True)
PONG = Frame(Opcode.PONG, b"").serialize(mask=True)
LAWS = [make_frame(encode_control(SetLaw(law=law)), KEY) for law in (Law.PI, Law.PREDICTIVE)]
HTTP = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"
ASKED = REQUEST.replace(b"\r\n\r\n", f"\r\nSec-WebSocket-Protocol: {SUBPROTOCOL}\r\n\r\n".encode())
numbers = itertools.count()


def opened(url: str) -> socket.socket:
    end = socket.create_connection(("127.0.0.1", int(url.rpartition(":")[2])), timeout=5.0)
    end.settimeout(None)  # with a timeout, no call returns at once
    end.sendall(ASKED + make_frame(hello_text(f"flood{next(numbers)}"), KEY))
    return end


def blast(*batches: bytes) -> Callable[[str, Callable[[], bool]], None]:
    """One connection after the other that sends as fast as it can."""

    def flood(url: str, go_on: Callable[[], bool]) -> None:
        while go_on():
            with contextlib.suppress(OSError), opened(url) as end:
                for data in itertools.cycle(batches):
                    if not go_on():
                        return
                    end.sendall(data)
                    # Who does not read is slowed down by the answers to its pings.
                    with contextlib.suppress(BlockingIOError):
                        end.recv(1 << 20, socket.MSG_DONTWAIT)

    return flood


def asks(url: str, go_on: Callable[[], bool]) -> None:
    """Requests as fast as they are answered."""
    while go_on():
        with contextlib.suppress(OSError):
            address = ("127.0.0.1", int(url.rpartition(":")[2]))
            with socket.create_connection(address, timeout=5.0) as end:
                end.sendall(HTTP)
                end.recv(1 << 16)


def joins(url: str, go_on: Callable[[], bool]) -> None:
    while go_on():
        with contextlib.suppress(OSError), opened(url) as end:
            end.recv(1)


def silent(said: bytes) -> Callable[[str, Callable[[], bool]], None]:
    """Connections that never ask, and say no more than that."""

    def flood(url: str, go_on: Callable[[], bool]) -> None:
        address = ("127.0.0.1", int(url.rpartition(":")[2]))
        with contextlib.ExitStack() as ends:
            while go_on():
                with contextlib.suppress(OSError):
                    end = ends.enter_context(socket.create_connection(address, timeout=5.0))
                    end.sendall(said)

    return flood


def trickles(url: str, go_on: Callable[[], bool]) -> None:
    """A request a byte at a time, and never the last one."""
    while go_on():
        with contextlib.suppress(OSError):
            address = ("127.0.0.1", int(url.rpartition(":")[2]))
            with socket.create_connection(address, timeout=5.0) as end:
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                for byte in REQUEST[:-1]:
                    end.sendall(bytes([byte]))


def crowd(
    url: str, go_on: Callable[[], bool], said: Callable[[int], bytes], number: int = 12
) -> None:
    """Several who each send something ten times a second."""
    with contextlib.ExitStack() as stack:
        ends = [stack.enter_context(opened(url)) for _ in range(number)]
        for turn in itertools.count():
            if not go_on():
                return
            for end in ends:
                with contextlib.suppress(OSError):
                    end.sendall(said(turn))
                    end.setblocking(False)
                    end.recv(1 << 20)
                    end.setblocking(True)
            threading.Event().wait(0.1)


def below_every_budget(url: str, go_on: Callable[[], bool]) -> None:
    """As much as nobody is closed for."""

    def said(turn: int) -> bytes:
        seqs = range(11 * turn + 1, 11 * turn + 12)
        samples = b"".join(make_frame(sample(seq, FAR, ZERO).encode(), KEY) for seq in seqs)
        return samples + LAWS[turn % 2] + (PING if turn % 3 == 0 else b"")

    crowd(url, go_on, said)


def teleports(url: str, go_on: Callable[[], bool]) -> None:
    """A surface is searched anew for each."""
    draw = random.Random(1)

    def said(turn: int) -> bytes:
        frames = b""
        for k in range(6):
            angle, height = draw.uniform(0.0, 2.0 * math.pi), draw.uniform(-1.0, 1.0)
            wide = 0.098 * math.sqrt(1.0 - height * height)
            probe = (wide * math.cos(angle), wide * math.sin(angle), 0.098 * height)
            frames += make_frame(sample(6 * turn + k + 1, probe, ZERO).encode(), KEY)
        return frames

    crowd(url, go_on, said)


def batches(first: int, size: int) -> bytes:
    """Samples in a row."""
    seqs = range(first, first + size)
    return b"".join(make_frame(sample(seq, FAR, ZERO).encode(), KEY) for seq in seqs)


FLOODS = {
    "samples": blast(*(batches(1 + 500 * number, 500) for number in range(100))),
    "pings": blast(PING * 500),
    "pongs": blast(PONG * 1000),
    "laws": blast(b"".join(LAWS) * 100),
    "requests": asks,
    "joins": joins,
    "silent": silent(b""),
    "half of a request": silent(REQUEST[:40]),
    "a request byte by byte": trickles,
    "below every budget": below_every_budget,
    "teleports": teleports,
}


def main() -> None:
    ended, flood = threading.Event(), threading.Thread()
    print("ready", flush=True)
    for line in sys.stdin:
        ended.set()
        if flood.is_alive():
            flood.join()
        kind, _, url = line.strip().partition(" at ")
        if url:
            stop = ended = threading.Event()
            flood = threading.Thread(
                target=FLOODS[kind], args=(url, lambda stop=stop: not stop.is_set()), daemon=True
            )
            flood.start()
        print(kind, flush=True)


if __name__ == "__main__":
    main()
