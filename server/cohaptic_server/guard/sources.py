"""Checks traffic and log lines of each connection and of each source against their budgets.

`Meter` checks the messages of one connection. `LogLines` limits the rate of log lines about each
source, so that no source fills a disk. `Sources` checks the requests of each source. The number of
remembered sources is bounded: sources without connections and without unread responses are
forgotten, starting with those that have been silent for longest.
"""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass, replace
from functools import lru_cache
from http import HTTPStatus

from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic_server.guard.limits import FULL, Budget, Limits, spend, wait


class Meter:
    """Counts the messages of one connection, and reports an error if they exceed its budgets.

    Args:
        simulation_hz: Ticks of the server per second [Hz].
    """

    def __init__(self, limits: Limits, simulation_hz: float) -> None:
        self._limits = limits
        self._sample_budget = limits.samples_at(simulation_hz)
        self._samples = self._rows = self._texts = self._beats = FULL

    def sample(self, now: float) -> RemoteProtocolError | None:
        """Count a read of the socket that brought one sample, the usual case.

        Returns:
            Error if the budget of samples is exceeded; None if not.
        """
        bucket = spend(self._samples, 1.0, self._sample_budget, now)
        if bucket is None:
            return too_many("samples", 1, self._sample_budget)
        self._samples = bucket
        return None

    def read(
        self, samples: int, rows: int, texts: int, beats: int, now: float
    ) -> RemoteProtocolError | None:
        """Count the messages of one read of the socket.

        Args:
            samples: Small binary messages.
            rows: Longer binary messages.
            texts: Other messages and fragments.
            beats: Pings, pongs and closes.
            now: Time [s].

        Returns:
            Error if a budget is exceeded; None if not.
        """
        limits = self._limits
        # A read that brings less than a frame costs time as well.
        samples = samples or not rows
        left = spend(self._samples, samples, self._sample_budget, now)
        if left is None:
            return too_many("samples", samples, self._sample_budget)
        self._samples = left
        if rows:
            left = spend(self._rows, rows, limits.rows, now)
            if left is None:
                return too_many("rows", rows, limits.rows)
            self._rows = left
        if texts:
            left = spend(self._texts, texts, limits.texts, now)
            if left is None:
                return too_many("control messages", texts, limits.texts)
            self._texts = left
        if beats:
            left = spend(self._beats, beats, limits.beats, now)
            if left is None:
                return too_many("pings and pongs", beats, limits.beats)
            self._beats = left
        return None


def too_many(what: str, more: int, budget: Budget) -> RemoteProtocolError:
    """Return the error for a client that has exceeded a budget.

    Args:
        what: Kind of the requests, in the plural.
        more: Number of requests that exceeded the budget.
    """
    value, limit = f"too many: {more} more", f"at most {budget}"
    field = what.replace(" ", "_")
    return RemoteProtocolError(f"number of {what}", value, limit, CloseCode.TOO_MANY, field)


_MAX_LOGGED = 1024


@dataclass(frozen=True, slots=True)
class _Logged:
    bucket: float = FULL
    left_out: int = 0
    since: float = 0.0  # time of the first line that was left out [s]


class LogLines:
    """Rate limits of log lines, one for each source, with the numbers of omitted lines.

    Args:
        budget: Budget of each source.
    """

    def __init__(self, budget: Budget) -> None:
        self._budget = budget
        self._known: dict[str, _Logged] = {}

    def pass_on(self, source: str, now: float) -> bool:
        """Count a line about a source, and return whether the line is to be written."""
        known = self._known.pop(source, _Logged())
        spent = spend(known.bucket, 1.0, self._budget, now)
        if spent is None:
            since = known.since if known.left_out else now
            self._known[source] = _Logged(known.bucket, known.left_out + 1, since)
        else:
            self._known[source] = _Logged(spent, known.left_out, known.since)
        while len(self._known) > _MAX_LOGGED:
            self._known.pop(next(iter(self._known)))
        return spent is not None

    def left_out(self, now: float, after: float = 0.0) -> list[tuple[str, int]]:
        """Return the sources and the number of omitted lines about each, and reset the numbers.

        Args:
            now: Time [s].
            after: Only sources whose first omitted line is at least this old are returned [s].
        """
        due = [
            (name, known.left_out)
            for name, known in self._known.items()
            if known.left_out and now - known.since >= after
        ]
        for name, _ in due:
            self._known[name] = _Logged(self._known[name].bucket)
        return due


_MAX_SOURCES = 4096  # half a megabyte; the limits for all addresses stop an attacker with more
UNKNOWN = "unknown"


def address_of(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """Parse an IP address; an IPv4-mapped IPv6 address becomes IPv4; None if invalid."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return None
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return mapped or address


@lru_cache(maxsize=_MAX_SOURCES)
def source_of(host: str) -> str:
    """Return the source of a connection: its IPv4 address, or its IPv6 /64 network.

    One subscriber has one /64 network. The IPv6 loopback address is a source of its own; all
    invalid addresses are the source `UNKNOWN`.

    Args:
        host: Address of the other end, as a socket names it.
    """
    address = address_of(host)
    if address is None:
        return UNKNOWN
    if address.version == 4 or address.is_loopback:
        return str(address)
    return str(ipaddress.ip_network((address, 64), strict=False))


@dataclass(frozen=True, slots=True)
class Refusal:
    """Refusal of a connection or of a response.

    Args:
        why: Reason of the refusal, for people.
        retry: Delay after which the client may try again [s].
        status: HTTP status.
    """

    why: str
    retry: float
    status: HTTPStatus = HTTPStatus.TOO_MANY_REQUESTS


@dataclass(frozen=True, slots=True)
class _Source:
    """Open connections and unread bytes of one source, and its token buckets (`limits.py`)."""

    open: int = 0
    unread: int = 0
    connections: float = FULL
    joins: float = FULL
    texts: float = FULL
    dismissals: float = FULL
    points: float = FULL


class Sources:
    """Counts the requests of all sources, and checks them against their budgets.

    Attributes:
        open: Number of open connections.
        unread: Bytes of responses that clients have not taken yet.
        refused: Number of connections refused so far.
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.open = self.unread = self.refused = 0
        self._known: dict[str, _Source] = {}

    def __len__(self) -> int:
        return len(self._known)

    def enter_proxy(self, source: str, now: float) -> Refusal | None:
        """Count or refuse a new connection of a proxy, until its visitor is known.

        Only the total number of connections is checked, since a proxy serves many people.
        """
        if self.open >= self.limits.open_in_all:
            self.refused += 1
            return Refusal(f"open connections: at most {self.limits.open_in_all}", 5.0)
        known = self._known.get(source, _Source())
        self.open += 1
        self._keep(source, replace(known, open=known.open + 1), now)
        return None

    def enter(self, source: str, now: float) -> Refusal | None:
        """Count or refuse a new connection of a visitor; a counted one needs `leave` at its end."""
        limits, known = self.limits, self._known.get(source, _Source())
        refusal = self._refusal(known, now)
        if refusal is not None:
            self.refused += 1
            return refusal
        spent = spend(known.connections, 1.0, limits.connections, now)
        if spent is None:
            self.refused += 1
            what = f"new connections from {source}: at most {limits.connections}"
            return Refusal(what, wait(known.connections, 1.0, limits.connections, now))
        self.open += 1
        self._keep(source, replace(known, open=known.open + 1, connections=spent), now)
        return None

    def leave(self, source: str) -> None:
        """Count the end of a connection that `enter` or `enter_proxy` has counted."""
        known = self._known.get(source)
        if known is not None and known.open:
            self.open -= 1
            self._known[source] = replace(known, open=known.open - 1)

    def join(self, source: str, now: float) -> None:
        """Count a join (to touch or to watch) or a change of name.

        Raises:
            RemoteProtocolError: The source has exceeded its rate limit of joins.
        """
        known, budget = self._known.get(source, _Source()), self.limits.joins
        spent = spend(known.joins, 1.0, budget, now)
        if spent is None:
            raise too_many("joins from one address", 1, budget)
        self._keep(source, replace(known, joins=spent), now)

    def say(self, source: str, texts: int, now: float) -> RemoteProtocolError | None:
        """Count control messages of a source; return an error if they exceed the budget."""
        known, budget = self._known.get(source, _Source()), self.limits.texts_in_all
        spent = spend(known.texts, texts, budget, now)
        if spent is None:
            return too_many("control messages from one address", texts, budget)
        self._keep(source, replace(known, texts=spent), now)
        return None

    def point(self, source: str, now: float) -> bool:
        """Count a message that points at the surface; return False if it exceeds the budget."""
        known = self._known.get(source, _Source())
        spent = spend(known.points, 1.0, self.limits.points_in_all, now)
        if spent is not None:
            self._keep(source, replace(known, points=spent), now)
        return spent is not None

    def dismiss(self, source: str, now: float) -> None:
        """Count a connection that is closed because its client has exceeded a budget."""
        known, budget = self._known.get(source, _Source()), self.limits.dismissals
        spent = spend(known.dismissals, 1.0, budget, now)
        if spent is None:  # all open connections may ask for too much at once
            spent = now + budget.burst / budget.rate
        self._keep(source, replace(known, dismissals=spent), now)

    def respond(self, source: str, size: int, now: float) -> Refusal | None:
        """Count or refuse an HTTP response of `size` bytes; a counted one needs `taken` later."""
        limits, known = self.limits, self._known.get(source, _Source())
        for waits, limit, whose in (
            (known.unread, limits.unread, f"for {source}"),
            (self.unread, limits.unread_in_all, "for all"),
        ):
            # A single response is served whatever its size, since a large object's page must load.
            if waits and waits + size > limit:
                why = f"{waits:,} bytes {whose} are not read yet; the limit is {limit:,}"
                return Refusal(why, 1.0)
        self.unread += size
        self._keep(source, replace(known, unread=known.unread + size), now)
        return None

    def taken(self, source: str, size: int) -> None:
        """Subtract `size` bytes of responses that the client has taken or that were given up."""
        known = self._known.get(source)
        if known is not None:
            self.unread -= min(size, known.unread)
            self._known[source] = replace(known, unread=max(0, known.unread - size))

    def _refusal(self, known: _Source, now: float) -> Refusal | None:
        limits = self.limits
        if known.open >= limits.open:
            return Refusal(f"open connections from one address: at most {limits.open}", 5.0)
        if self.open >= limits.open_in_all:
            return Refusal(f"open connections: at most {limits.open_in_all}", 5.0)
        if spend(known.dismissals, 1.0, limits.dismissals, now) is None:
            sentence = f"connections that asked for too much: at most {limits.dismissals}"
            return Refusal(sentence, wait(known.dismissals, 1.0, limits.dismissals, now))
        return None

    def _keep(self, source: str, known: _Source, now: float) -> None:
        self._known.pop(source, None)
        self._known[source] = known
        if len(self._known) <= _MAX_SOURCES:
            return
        # Forget the addresses that were silent for longest: a quarter of all at once, so that the
        # search happens seldom.
        closed = [name for name, other in self._known.items() if not other.open + other.unread]
        for name in closed[: max(1, _MAX_SOURCES // 4)]:
            del self._known[name]
