"""Measures the values that a handle's file needs: counts per metre, and two directions.

The user moves the handle by hand along a ruler with the motor off. Then the motor nudges it, gently
and for a moment, one way and then the other. With a wrong direction an object would pull the hand
in instead of pushing back, so a motion of the handle that the motor did not cause (by the handle's
own weight, or by a hand on it) must not count.
"""

from __future__ import annotations

from collections.abc import Callable

from cohaptic.clock import Clock
from cohaptic.errors import DeviceError
from cohaptic.runtime.signals_put_off import signals_put_off
from cohaptic_drivers.oneaxis.frames import NAME, Description, Report
from cohaptic_drivers.oneaxis.link import BoardLink

WAY = 0.04  # m along the arc by which the user moves the handle
_FEWEST = 40  # counts over `WAY`; with fewer the hand would feel steps of a millimetre
NUDGE = 0.25  # share of the board's current limit at the end of a nudge
NUDGE_TIME = 0.6  # s at most; our firmware's own ramp takes half a second
_ENOUGH = 0.003  # m; the nudge ends after this motion
_PERIOD = 0.001  # s
_ANSWER = 0.5  # s to wait for a report
_REST = 0.2  # s without a motion, after which the handle is at rest
_UNSEEN = 0.05  # s; a longer gap between two readings (busy machine) does not prove a rest
_LONGEST_REST = 3.0  # s that the handle may take to come to rest
_STILL = 0.1  # fraction of `_ENOUGH` by which a handle at rest may creep


def calibrate(
    link: BoardLink, board: Description, clock: Clock, ask: Callable[[str], None]
) -> list[str]:
    """Measure a handle with the user's help; return the lines of its file.

    Args:
        link: Connection to the handle's board, with zero current.
        board: Description that the board sent of itself.
        ask: Function that tells the user what to do, and returns when the user has done it.

    Raises:
        DeviceError: The handle did not move as expected, or the board is gone.
    """
    ask("Hold the handle in its middle, and keep it there")
    start = _counts(link, clock)
    ask(f"Move it {1e3 * WAY:.0f} mm along its arc, away from you, and hold it there")
    way = _counts(link, clock) - start
    if abs(way) < _FEWEST:
        problem = f"its sensor told {abs(way)} counts for {1e3 * WAY:.0f} mm"
        raise DeviceError(NAME, problem, "see that the sensor turns with the handle")
    sensor = 1 if way > 0 else -1
    per_metre = abs(way) / WAY
    ask("Put the handle into its middle and let go of it: the motor will nudge it")
    moved = _way_of_motor(link, clock, NUDGE * board.limit, _ENOUGH * per_metre)
    lines = [f"counts_per_metre = {per_metre:.0f}", f"sensor_direction = {sensor}"]
    if moved == 0:
        lines.append("# The handle did not move: motor_direction = 1 or -1 has to be found by hand")
    else:
        lines.append(f"motor_direction = {sensor * moved}")
    lines.append("# N m/A, of the motor's data sheet, without which there is no force:")
    return [*lines, "# torque_constant = "]


def _counts(link: BoardLink, clock: Clock) -> int:
    """Return the position of the handle in counts; a command of zero current requests it."""
    end = clock.now() + _ANSWER
    link.poll()
    while True:
        link.send(0.0)
        reported = link.poll()
        if reported is not None:
            return _whole(reported).counts
        if clock.now() >= end:
            raise DeviceError(NAME, "its board does not answer", "see to its cable")
        clock.sleep_until(clock.now() + _PERIOD)


def _way_of_motor(link: BoardLink, clock: Clock, amperes: float, enough: float) -> int:
    """Return the sign of the counts by which a positive current moves the handle; 0 if unknown."""
    ways = list[int]()
    for current in (amperes, -amperes):
        _await_rest(link, clock, max(1.0, _STILL * enough))
        ways.append(_nudge(link, clock, current, enough))
    one, other = ways
    if one * other > 0:
        problem = "its handle moved the same way with either current"
        raise DeviceError(NAME, problem, "let go of it, on a board that stands level")
    return (one > 0) - (one < 0) if other else 0


def _await_rest(link: BoardLink, clock: Clock, still: float) -> None:
    """Wait until the handle has moved by no more than `still` counts for `_REST`."""
    end = clock.now() + _LONGEST_REST
    place = _counts(link, clock)
    since = looked = clock.now()
    while looked - since < _REST:
        if looked > end:
            advice = "let go of it, on a board that stands level"
            raise DeviceError(NAME, "its handle does not come to rest", advice)
        before, now, looked = looked, _counts(link, clock), clock.now()
        if abs(now - place) > still or looked - before > _UNSEEN:
            place, since = now, looked


def _nudge(link: BoardLink, clock: Clock, amperes: float, enough: float) -> int:
    """Move the handle by a growing current; return its motion in counts, 0 if below `enough`."""
    start, begin = _counts(link, clock), clock.now()
    moved = 0
    with signals_put_off() as ended:
        try:
            while (passed := clock.now() - begin) < NUDGE_TIME and abs(moved) < enough:
                if ended():
                    break
                link.send(amperes * passed / NUDGE_TIME)
                reported = link.poll()
                moved = moved if reported is None else _whole(reported).counts - start
                clock.sleep_until(clock.now() + _PERIOD)
        finally:
            link.send(0.0)
    return moved if abs(moved) >= enough else 0


def _whole(reported: Report) -> Report:
    if reported.faulty:
        raise DeviceError(NAME, "its board says that its sensor failed", "see to its magnet")
    return reported
