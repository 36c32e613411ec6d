"""The state of a client, as users and programs read it: from the loop's newest row and report.

Functions of these and of the connection's timing, without I/O.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any

from cohaptic.status.report import TouchStatus
from cohaptic.status.row import Row, acted_in
from cohaptic_client.devices.catalogue import device_info
from cohaptic_client.loop.added import RuleChoice, reasons_of
from cohaptic_client.loop.safety import Mode
from cohaptic_client.network.timing import LinkTiming
from cohaptic_client.settings import ClientSettings


@functools.cache
def _names_of(rules: tuple[RuleChoice, ...]) -> tuple[str, ...]:
    """Return the names in the ledger of rules of other packages and of scripts."""
    return tuple(reasons_of(rules))


def touch_status(
    settings: ClientSettings,
    row: Row,
    loop: Mapping[str, Any],
    timing: LinkTiming,
    *,
    server_to_wall: float,
    to_wall: float,
    silent_after: float | None,
    stopping: bool,
) -> TouchStatus:
    """Return the state of a client whose loop has begun.

    Args:
        row: Newest row of the client's loop.
        loop: Newest report of the client's loop.
        timing: Timing of the client's connection.
        server_to_wall: Unix time less the server's clock [s].
        to_wall: Unix time less this client's clock [s].
        silent_after: Time without a patch after which the server counts as silent [s]; None if
            unknown.
        stopping: Whether the client has told its loop to end.
    """
    offset = 0.0
    if timing.best is not None:
        offset = timing.clock_offset + server_to_wall - to_wall
    return TouchStatus(
        name=settings.name,
        state=state_in_words(
            row,
            silent_after=silent_after,
            stopping=stopping,
            held=loop.get("mode") == Mode.FAULT.value,
            device_silent=bool(loop.get("device_silent", False)),
        ),
        force=math.hypot(row.fx, row.fy, row.fz),
        felt_from_others=row.scale * row.felt_from_others,
        indentation=row.indentation,
        k_o=row.k_o,
        k_h=row.k_h,
        lag=row.lag,
        max_stiffness=device_info(settings.device).max_stiffness,
        along=row.along if settings.friction > 0.0 else None,
        law=settings.law.value,
        round_trip=timing.round_trip,
        jitter=timing.jitter,
        clock_offset=offset,
        clock_error=timing.clock_error,
        loop_hz=float(loop.get("loop_hz", 0.0)),
        loop_late_p99=float(loop.get("late_p99", 0.0)),
        loop_missed=int(loop.get("missed", 0)),
        wavers=float(loop.get("wavers", 0.0)),
        level=row.level,
        wanted=row.wanted,
        max_force=settings.force_limit,
        fault=str(loop.get("fault", "")),
        ledger=acted_in(row, _names_of(settings.rules)),
    )


def status_before_touch(name: str, place: tuple[int, int] | None) -> TouchStatus:
    """Return the state of a client whose loop has not begun.

    Args:
        name: Name of the client.
        place: Position in the queue for a full room, from 1, and the length of the queue; None for
            a client that is in no queue.
    """
    if place is None:
        return TouchStatus(name=name, state="connecting")
    return TouchStatus(name=name, state=f"place {place[0]} of {place[1]}")


def state_in_words(
    row: Row,
    *,
    silent_after: float | None,
    stopping: bool,
    held: bool = False,
    device_silent: bool = False,
) -> str:
    """Return the state of a client in a word or two, such as "touching" or "server silent".

    The arguments `row`, `silent_after` and `stopping` are those of `touch_status`.

    Args:
        held: Whether a fault keeps the force off until the user acknowledges the fault.
        device_silent: Whether the device should send reports but sends none.
    """
    if stopping:
        return "stopped"
    if held:
        return "fault"
    if device_silent:
        return "device silent"
    if row.tick == 0:
        return "connecting"
    # On a link with jitter the loop waits longer (`arrival.is_silent`), with the full force.
    silent = silent_after is not None and row.patch_age > silent_after
    if silent and row.scale < 1.0:
        return "server silent"
    if row.scale == 0.0:
        return "waiting"
    return "touching" if row.wanted > 0.0 else "free"
