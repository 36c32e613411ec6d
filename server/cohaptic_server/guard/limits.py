"""Rate limits: token buckets, all budgets with their reasons, and changes by the owner.

A bucket is one number: the time at which it is full again [s]. With rate r and burst b, at most
b + r t tokens can be spent within any time t. The current time is an argument. If the clock was set
back, a bucket may seem emptier than possible; such a bucket counts as full, so that nobody is
locked out until the clock reaches the old time again.

Costs of handling were measured on one core of 2026: a sample 3 us, a ping 4 us, a control message
16 to 60 us, a connection 20 us if it is refused and 300 us if it is served.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import Any

from cohaptic.errors import SettingError

FULL = float("-inf")  # a bucket from which nothing was taken


@dataclass(frozen=True, slots=True)
class Budget:
    """Rate limit of one kind of request.

    Args:
        rate: Long-term rate [1/s].
        burst: Number of requests that may come at once after a pause.
    """

    rate: float
    burst: float

    def __str__(self) -> str:
        return f"{self.rate:g} a second and {self.burst:g} at once"


def spend(bucket: float, amount: float, budget: Budget, now: float) -> float | None:
    """Take tokens out of a bucket; return the new bucket, or None if it has too few tokens.

    Args:
        bucket: Time at which the bucket is full again [s].
        amount: Number of tokens wanted.
        now: Time [s].
    """
    empty = now + budget.burst / budget.rate
    if bucket < now:
        bucket = now
    elif bucket > empty + 1e-3 / budget.rate:
        bucket = now
    bucket += amount / budget.rate
    # A slack of a millionth of a token, since rounding may reduce the content by that much.
    return bucket if bucket <= empty + 1e-6 / budget.rate else None


def wait(bucket: float, amount: float, budget: Budget, now: float) -> float:
    """Return the time until `amount` tokens can be taken out of a bucket [s].

    Args:
        bucket: Time at which the bucket is full again [s].
        amount: Number of tokens wanted, at most the burst.
        now: Time [s].
    """
    missing = bucket - now
    if missing > (budget.burst + 1e-3) / budget.rate:
        return 0.0
    return max(0.0, missing - (budget.burst - amount) / budget.rate)


_RATE = re.compile(r"([0-9.]+)(?::([0-9.]+))?")
_LARGEST = 1e6  # highest rate or number; a larger limit would limit nothing


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one connection, of one address and of all addresses together.

    An address stands for a source here: an IPv4 address, or an IPv6 /64 network.

    Args:
        samples: Small binary messages of a connection, and reads of its socket. The rate is their
            number per tick; the burst is a time [s], with one message for each of its ticks. A
            client sends one sample per tick, and after a stall the network delivers up to 10 s of
            samples at once, since TCP gives up after that time (`USER_TIMEOUT_MS`).
        rows: Longer binary messages of a connection, which bring rows for a recording: one beside
            each sample, and more from a loop of 4 kHz; after a stall 10 s of them.
        texts: Other messages of a connection, and fragments. A person moves a slider at the rate of
            the screen for a second or two.
        beats: Pings, pongs and closes of a connection. A library pings every few seconds.
        texts_in_all: Other messages of all connections of an address; people move few sliders.
        points: Points on the surface that a watcher sends; all pages in the room receive them.
        points_in_all: Points from all connections of an address.
        connections: New connections of an address, each of which is one HTTP request or one
            websocket. A page asks for Green's functions one by one, a few hundred for a new hand.
        joins: Joins of an address, to touch or to watch. A classroom behind one address joins
            within a minute, and the server announces every join to everybody.
        dismissals: Connections of an address that were closed because of one of the budgets above.
            Each may have used a whole burst, which takes 5 ms at worst; beyond this rate the
            address has to wait.
        lines: Log lines about one address.
        open: Connections of an address at a time.
        open_in_all: Connections of all addresses at a time; fewer if the system allows fewer files.
        waiting: Places of an address in the queue for a full room. One address must not fill the
            queue, but several people may share a classroom's address.
        unread: Bytes of HTTP responses that an address has not taken yet; the page is 1 MB.
        unread_in_all: Bytes of HTTP responses that all addresses have not taken yet.
    """

    samples: Budget = field(default=Budget(2, 12))
    rows: Budget = field(default=Budget(300, 3000))
    texts: Budget = field(default=Budget(60, 180))
    texts_in_all: Budget = field(default=Budget(200, 400))
    points: Budget = field(default=Budget(0.5, 4))
    points_in_all: Budget = field(default=Budget(2, 10))
    beats: Budget = field(default=Budget(4, 40))
    connections: Budget = field(default=Budget(100, 600))
    joins: Budget = field(default=Budget(5, 100))
    dismissals: Budget = field(default=Budget(0.2, 10))
    lines: Budget = field(default=Budget(2, 40))
    open: int = 256
    open_in_all: int = 2000
    waiting: int = 4
    unread: int = 16 * 2**20
    unread_in_all: int = 128 * 2**20

    def __post_init__(self) -> None:
        for name, value in self.items():
            values = (value.rate, value.burst) if isinstance(value, Budget) else (value,)
            highest = _LARGEST if isinstance(value, Budget) else _LARGEST * 2**20
            if not all(math.isfinite(v) and 0.0 < v <= highest for v in values):
                raise SettingError(f"limit {name}", value, f"above 0 and at most {highest:g}")
            if isinstance(value, Budget) and value.burst < 1.0:
                raise SettingError(f"limit {name}", value, "at least 1 at once")

    def samples_at(self, simulation_hz: float) -> Budget:
        """Return the budget of samples per second at a simulation rate [Hz] (ticks per second)."""
        return Budget(self.samples.rate * simulation_hz, self.samples.burst * simulation_hz)

    def items(self) -> list[tuple[str, Budget | int]]:
        """Return the names and values of all limits."""
        return [(f.name, getattr(self, f.name)) for f in fields(self)]

    def changed(self, wishes: Iterable[str]) -> Limits:
        """Return a copy of these limits with some changes.

        Args:
            wishes: Changes, each `NAME=NUMBER`, or `NAME=RATE:BURST` for a rate limit.

        Raises:
            SettingError: There is no such limit, or the limit cannot have this value.
        """
        limits = self
        known = dict(self.items())
        for wish in wishes:
            name, _, value = wish.partition("=")
            if name not in known:
                raise SettingError("limit", repr(wish[:60]), f"NAME=NUMBER of: {', '.join(known)}")
            changed: dict[str, Any] = {name: _value(name, value, known[name])}
            limits = replace(limits, **changed)
        return limits


def _value(name: str, text: str, before: Budget | int) -> Budget | int:
    match = _RATE.fullmatch(text)
    try:
        if isinstance(before, Budget) and match is not None and match[2] is not None:
            return Budget(float(match[1]), float(match[2]))
        if not isinstance(before, Budget):
            return int(text)
    except ValueError:
        pass
    form = "RATE:BURST, such as 100:600" if isinstance(before, Budget) else "a whole number"
    raise SettingError(f"limit {name}", repr(text[:60]), form)
