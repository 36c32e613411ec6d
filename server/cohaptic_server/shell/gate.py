"""Who may come in and how much they may ask for, at this server: the budgets with their clock."""

from __future__ import annotations

import logging
import sys
from dataclasses import replace
from typing import Any

from cohaptic.clock import Clock
from cohaptic_server.guard.limits import Limits
from cohaptic_server.guard.log_lines import LogLines
from cohaptic_server.guard.meter import Meter
from cohaptic_server.guard.sources import UNKNOWN, Sources, source_of

log = logging.getLogger("cohaptic.server")

_MOST_FILES = 10**6
_OWN_FILES = 40  # a server has 20 or so, and an upload and a process that starts some more
_REPORTED_AFTER = 10.0  # s since the first line that was left out


class Gate:
    """Of one server.

    Args:
        limits: All budgets.
        clock: Of the server.
        simulation_hz: Its ticks per second.

    Attributes:
        limits: The same, with no more connections than the system has files for.
        clock: The same.
        sources: Of all addresses.
    """

    def __init__(self, limits: Limits, clock: Clock, simulation_hz: float = 60.0) -> None:
        self.limits = limits = replace(limits, open_in_all=min(limits.open_in_all, _files()))
        self.clock = clock
        self.sources = Sources(limits)
        self._lines = LogLines(limits.lines)
        self._next_report = 0.0
        self._simulation_hz = simulation_hz

    def meter(self) -> Meter:
        """Of a new connection."""
        return Meter(self.limits, self._simulation_hz)

    def tell(self, source: str, text: str, *, warning: bool = False) -> None:
        """Write a line about an address to the log, unless there are too many about it."""
        if self._lines.pass_on(source, self.clock.now()):
            log.log(logging.WARNING if warning else logging.INFO, "%s", text)

    def report(self, after: float = _REPORTED_AFTER) -> None:
        """Tell how many lines were left out; called at every tick, and does nothing in most."""
        now = self.clock.now()
        if after and now < self._next_report:
            return
        self._next_report = now + 1.0
        for source, count in self._lines.left_out(now, after):
            log.warning("%d lines about %s were left out", count, source)


def _files() -> int:
    """Connections that the system gives files for, beside those that the server needs itself."""
    if sys.platform == "win32":
        return _MOST_FILES
    import resource

    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return max(8, (_MOST_FILES if soft == resource.RLIM_INFINITY else soft) - _OWN_FILES)


def source_of_peer(peername: Any) -> str:
    """Whom a connection is counted with, from what its transport calls the other end."""
    # Of a socket of the internet a tuple that begins with the address, and text of any other.
    return source_of(str(peername[0])) if peername and not isinstance(peername, str) else UNKNOWN
