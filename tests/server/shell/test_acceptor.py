"""An acceptor without an event loop: what one turn does, and what is held meanwhile."""

from __future__ import annotations

import contextlib
import gc
import select
import socket
import ssl
import sys
import tracemalloc
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

import pytest

from cohaptic.clock import SystemClock
from cohaptic_server.guard.limits import Limits
from cohaptic_server.shell import acceptor as door_module
from cohaptic_server.shell.acceptor import Acceptor
from cohaptic_server.shell.limiter import ConnectionLimiter, Taken
from cohaptic_server.shell.wire import HEAD_TIMEOUT
from tests.patience import PATIENCE
from tests.server.shell.stage import REQUEST
from tests.server.shell.test_first_bytes import hello

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a door holds nobody"),
]
WINDOW = door_module._WINDOW  # pyright: ignore[reportPrivateUsage]
MANY = ("open=100000", "open_in_all=100000", "connections=1000000:1000000")


@dataclass
class Timer:
    """What `call_later` returns."""

    after: float
    call: Callable[[], None]
    cancelled: bool = False

    def cancel(self) -> None:
        self.cancelled = True


@dataclass
class Turns:
    """Stands for the loop: turns and deadlines come when a test says so."""

    soon: list[Callable[[], None]] = field(default_factory=list[Callable[[], None]])
    timers: list[Timer] = field(default_factory=list[Timer])

    def call_soon(self, call: Callable[[], None]) -> None:
        self.soon.append(call)

    def call_later(self, after: float, call: Callable[[], None]) -> Timer:
        timer = Timer(after, call)
        if after == WINDOW:
            self.soon.append(call)
        else:
            self.timers.append(timer)
        return timer

    def go_on(self) -> None:
        soon, self.soon = self.soon, []
        for call in soon:
            call()

    def expire(self) -> None:
        """The one timer there is."""
        (timer,) = self.timers
        self.timers = []
        timer.call()


@dataclass
class Stand:
    """A acceptor, its limiter and those who come."""

    acceptor: Acceptor
    limiter: ConnectionLimiter
    clock: SystemClock
    turns: Turns
    guests: list[socket.socket] = field(default_factory=list[socket.socket])

    def come(self, many: int, said: bytes = b"") -> list[socket.socket]:
        new: list[socket.socket] = []
        for _ in range(many):
            new.append(socket.create_connection(self.acceptor.getsockname(), timeout=PATIENCE))
            if said:
                new[-1].sendall(said)
        while any(_under_way(guest) for guest in new):
            select.select([], [], [], 0.001)
        self.guests += new
        return new

    def turn(self) -> list[socket.socket]:
        """What one turn gives out."""
        found: list[socket.socket] = []
        with contextlib.suppress(BlockingIOError):
            while True:
                found.append(self.acceptor.accept()[0])
        self.turns.go_on()
        return found

    def until(self, condition: Callable[[], bool], given: list[socket.socket]) -> int:
        """Turns until it holds; what they give out is added."""
        for count in range(10_000):
            if condition():
                return count
            select.select([self.acceptor], [], [], 0.01)
            given += self.turn()
        raise AssertionError


@contextlib.contextmanager
def standing(*limits: str, tls: bool = False) -> Generator[Stand]:
    clock = SystemClock()
    limiter = ConnectionLimiter(Limits().changed(limits), clock)
    turns = Turns()
    loop: Any = turns
    with Acceptor.opened(("127.0.0.1", 0), socket.AF_INET, limiter, loop, tls=tls) as acceptor:
        stand = Stand(acceptor, limiter, clock, turns)
        yield stand
        for guest in stand.guests:
            guest.close()


@pytest.mark.parametrize(("said", "tls"), [(REQUEST, False), (hello(), True)])
def test_who_says_nothing_is_held_and_comes_out_whole_once_it_has_asked(
    said: bytes, tls: bool
) -> None:
    with standing(tls=tls) as stand:
        (guest,) = stand.come(1)
        given: list[socket.socket] = []
        stand.until(lambda: stand.acceptor.silent == 1, given)
        for at in range(0, len(said) - 1, 40):
            guest.sendall(said[at : min(at + 40, len(said) - 1)])
            select.select([stand.acceptor], [], [], 1.0)
            given += stand.turn()
        assert (given, stand.acceptor.silent, stand.limiter.sources.open) == ([], 1, 1)
        guest.sendall(said[-1:])
        stand.until(lambda: bool(given), given)
        assert isinstance(given[0], Taken)
        assert given[0].getpeername() == guest.getsockname()
        assert given[0].recv(len(said) + 1) == said
        assert (given[0].turns is not None) == tls
        assert (stand.acceptor.silent, stand.limiter.sources.open) == (0, 1)
        given[0].close()
        assert stand.limiter.sources.open == 0


def test_bytes_that_stay_do_not_wake_the_loop_again() -> None:
    with standing() as stand:
        given: list[socket.socket] = []
        stand.come(1, REQUEST[:10])
        stand.until(lambda: stand.acceptor.silent == 1, given)
        stand.turn()
        assert select.select([stand.acceptor], [], [], 0.05)[0] == []


def test_a_turn_lets_in_and_gives_out_few_and_whoever_waits_has_the_next() -> None:
    with standing(*MANY) as stand:
        given: list[socket.socket] = []
        stand.come(60, REQUEST)
        turns = 0
        while len(given) < 60:
            before = len(given)
            select.select([stand.acceptor], [], [], 1.0)
            given += stand.turn()
            assert len(given) - before <= 4
            turns += 1
        assert turns >= 15
        for one in given:
            one.close()


def test_after_the_work_of_a_window_the_loop_is_not_asked_again_before_the_next() -> None:
    """Else it would do nothing else, and take all of a core."""
    with standing(*MANY) as stand:
        stand.come(60)
        with contextlib.suppress(BlockingIOError):
            stand.acceptor.accept()
        assert 0 < stand.acceptor.silent <= 32
        assert select.select([stand.acceptor], [], [], 0.05)[0] == []
        stand.turns.go_on()
        assert select.select([stand.acceptor], [], [], 5.0)[0] == [stand.acceptor]


def test_those_who_are_silent_keep_nobody_waiting_who_asks() -> None:
    with standing(*MANY) as stand:
        given: list[socket.socket] = []
        stand.come(100)
        stand.until(lambda: stand.acceptor.silent == 100, given)
        stand.come(1, REQUEST)
        assert stand.until(lambda: bool(given), given) <= 3
        given[0].close()


def test_at_the_deadline_the_silent_are_closed_a_few_at_once_by_one_timer() -> None:
    with standing(*MANY) as stand:
        given: list[socket.socket] = []
        guests = stand.come(100)
        stand.until(lambda: stand.acceptor.silent == 100, given)
        assert [timer.after for timer in stand.turns.timers] == [HEAD_TIMEOUT]
        stand.turns.expire()  # too early, as a clock may have it
        assert stand.acceptor.silent == 100
        stand.clock.origin += HEAD_TIMEOUT + 1.0
        stand.turns.expire()
        assert stand.acceptor.silent == 36
        assert stand.turns.timers[0].after == 0.0
        stand.turns.expire()
        assert (stand.acceptor.silent, stand.limiter.sources.open, stand.turns.timers) == (0, 0, [])
        assert stand.limiter.traffic.refused == {"no request": 100}
        assert {guest.recv(1) for guest in guests} == {b""}


def test_who_goes_again_is_forgotten() -> None:
    with standing() as stand:
        given: list[socket.socket] = []
        for said in (b"", REQUEST[:10]):
            (guest,) = stand.come(1, said)
            stand.until(lambda: stand.acceptor.silent == 1, given)
            guest.close()
            stand.until(lambda: stand.acceptor.silent == 0, given)
        assert (given, stand.limiter.sources.open) == ([], 0)


def test_who_sends_byte_by_byte_is_passed_on_to_where_that_has_a_budget() -> None:
    with standing() as stand:
        given: list[socket.socket] = []
        (guest,) = stand.come(1)
        guest.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        while not given:
            guest.sendall(b"G")
            select.select([stand.acceptor], [], [], 1.0)
            given += stand.turn()
        assert len(given[0].recv(4096)) <= 70
        given[0].close()


def test_an_acceptor_that_closes_closes_those_in_its_backlog() -> None:
    with standing() as stand:
        guests = stand.come(5)
        stand.until(lambda: stand.acceptor.silent == 5, [])
        stand.acceptor.close()
        assert {guest.recv(1) for guest in guests} == {b""}
        assert stand.limiter.sources.open == 0
        assert all(timer.cancelled for timer in stand.turns.timers)


def test_a_silent_connection_takes_little_memory() -> None:
    """Of this process; what asyncio and the library make of one is 14 kB."""
    with standing(*MANY) as stand:
        stand.come(20)
        stand.until(lambda: stand.acceptor.silent == 20, [])
        gc.collect()
        tracemalloc.start()
        try:
            stand.come(100)
            before = tracemalloc.get_traced_memory()[0]
            stand.until(lambda: stand.acceptor.silent == 120, [])
            gc.collect()
            after = tracemalloc.get_traced_memory()[0]
        finally:
            tracemalloc.stop()
        assert (after - before) / 100 < 1000


def test_tls_that_is_none_is_passed_on_to_be_told() -> None:
    with standing(tls=True) as stand:
        given: list[socket.socket] = []
        stand.come(1, REQUEST)
        stand.until(lambda: bool(given), given)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        with pytest.raises(ssl.SSLError):
            context.wrap_bio(_filled(given[0]), ssl.MemoryBIO(), server_side=True).do_handshake()
        given[0].close()


def _under_way(guest: socket.socket) -> int:
    """Bytes that were sent and have not arrived yet, as far as the system tells."""
    if sys.platform != "linux":
        return 0
    import fcntl
    import termios

    return int.from_bytes(fcntl.ioctl(guest, termios.TIOCOUTQ, bytes(4)), sys.byteorder)


def _filled(connection: socket.socket) -> ssl.MemoryBIO:
    came = ssl.MemoryBIO()
    came.write(connection.recv(4096))
    return came
