"""Sentences for the user on faults, the law, the device and the scheduling of the haptic loop."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, Literal

from cohaptic_client.loop.safety import NOT_HELD

# s between two sentences about faults: a hand that is too fast in every other period would fill
# the terminal. The status line shows every fault.
FAULT_NEWS: Final = 2.0


Kind = Literal[
    "touching", "waiting", "fault", "device", "server", "user", "room", "machine", "recorded"
]


class News(str):
    """A sentence for the user, with the kind of event that it is about.

    Attributes:
        kind: touching (admitted to a room), waiting (for a place in a full room), fault (the force
            was taken off, or the fault was acknowledged), device (it is silent), server (lost, or
            another object), user (one joined, left or has a new name), room (an administrator
            acted), machine (its scheduling), recorded (the server records the session, or ends to).
    """

    kind: Kind

    def __new__(cls, kind: Kind, sentence: str) -> News:
        """Make a piece of news of a sentence."""
        news = super().__new__(cls, sentence)
        news.kind = kind
        return news


def fault_in_words(fault: str, *, held: bool, heard: bool) -> str:
    """Return a sentence on why the force is off and how the user brings it back.

    Args:
        fault: Fault in the words of the safety layer.
        held: Whether the force stays off until the user acknowledges the fault.
        heard: Whether the user can acknowledge the fault, by a terminal or a program that writes
            lines.
    """
    if held and not heard:
        how = "nobody can press Enter here, so end this and start again"
    elif held:
        how = "press Enter, then lift off the object to go on"
    elif fault == NOT_HELD:
        how = "hold it, and lift off the object to go on"
    else:
        how = "lift off the object to go on"
    return f"force off: {fault}; {how}"


def silence_in_words(status: Mapping[str, Any]) -> str:
    """Return a sentence if the device should send reports but sends none; else an empty string.

    Args:
        status: Newest report of the loop.
    """
    if not status.get("device_silent"):
        return ""
    return "the device sends nothing, and the tip stands still: is it in reach, and switched on?"


class FaultNews:
    """Decides which faults the user is told: each new one, but at most one per `FAULT_NEWS` [s]."""

    def __init__(self) -> None:
        self._report = ""
        self._next = -math.inf

    def is_new(self, fault: str, now: float) -> bool:
        """Return whether the caller should tell the user of this fault now.

        Args:
            fault: Present fault of the loop; empty for none.
            now: Present time [s].
        """
        if not fault:
            self._report = ""
        if not fault or fault == self._report or now < self._next:
            return False
        self._report, self._next = fault, now + FAULT_NEWS
        return True


def is_real_time(scheduling: str) -> bool:
    """Return whether the process has a priority that keeps its loop punctual beside other work.

    Args:
        scheduling: Scheduling in the words of `cohaptic.runtime.scheduling.prefer_this_process`.
    """
    return "real-time" in scheduling or "high priority" in scheduling


def scheduling_in_words(scheduling: str) -> str:
    """Return a warning if the system has refused real-time scheduling; else an empty string.

    Args:
        scheduling: Scheduling in words, as for `is_real_time`; empty before the loop's first
            report.
    """
    if not scheduling or is_real_time(scheduling):
        return ""
    return (
        "the system has refused real-time scheduling to the haptic loop, so that forces may come "
        "late while the machine is busy; `cohaptic doctor` says how to allow it"
    )
