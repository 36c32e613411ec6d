"""The state of a client, for people and programs, as a function of its parts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cohaptic.status.report import TouchStatus
from cohaptic.status.row import Row
from cohaptic_client.devices.catalogue import device_info
from cohaptic_client.loop.safety import Mode
from cohaptic_client.network.timing import LinkTiming
from cohaptic_client.settings import ClientSettings


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
    """State of a client whose loop has begun.

    Args:
        settings: Of the client.
        row: Newest row of its loop.
        loop: Newest report of its loop.
        timing: Of its connection.
        server_to_wall: Unix time less the server's clock [s].
        to_wall: Unix time less this client's clock [s].
        silent_after: Without a patch for this long the server counts as silent [s]; None unknown.
        stopping: Whether the loop was told to end.
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
        level=row.level,
        wanted=row.wanted,
        max_force=settings.force_limit,
        fault=str(loop.get("fault", "")),
    )


def status_before_touch(name: str, place: tuple[int, int] | None) -> TouchStatus:
    """State of a client whose loop has not begun.

    Args:
        name: Its name.
        place: In the queue before a full room, and their number; None for who is in none.
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
    """State of a client in a word or two; the arguments are those of `touch_status`.

    Args:
        row: Newest of the loop.
        silent_after: As there.
        stopping: As there.
        held: Whether a fault keeps the force off until the user acknowledges it.
        device_silent: Whether the device sends nothing though it should.
    """
    if stopping:
        return "stopped"
    if held:
        return "fault"
    if device_silent:
        return "device silent"
    if row.tick == 0:
        return "connecting"
    # On a link that jitters the loop waits for longer (`arrival.is_silent`).
    silent = silent_after is not None and row.patch_age > silent_after
    if silent and row.scale < 1.0:
        return "server silent"
    if row.scale == 0.0:
        return "waiting"
    return "touching" if row.wanted > 0.0 else "free"
