"""What a client tells a person of its haptic loop: its faults, and how it is scheduled."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from cohaptic.control.law import Law
from cohaptic_client.loop.safety import NOT_HELD

# s between two faults that are told: a hand that is too fast in every other period would fill the
# terminal. The state in the status line has each.
FAULT_NEWS: Final = 2.0


def fault_in_words(fault: str, *, held: bool, heard: bool) -> str:
    """Why the force is off, and what brings it back.

    Args:
        fault: As the safety layer tells it.
        held: Whether it stays until the user acknowledges it.
        heard: Whether the user can: there is a terminal, or a program that writes lines.
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


def law_in_words(law: Law, device: str) -> str:
    """What to tell of a law that is asked for; empty for one that holds what `docs/safety.md` says.

    Args:
        law: That is asked for.
        device: Its name; nobody holds a simulated one.
    """
    if not law.integrates or device == "simulated":
        return ""
    return (
        f"the law {law.value} goes on while the hand rests, so that a hostile server may move it"
        " at the device's full rate, not by 0.02 N in a millisecond; use it with servers that you"
        " trust"
    )


def silence_in_words(status: Mapping[str, Any]) -> str:
    """Words on a device that sends nothing though it should; empty while it does.

    Args:
        status: Newest report of the loop.
    """
    if not status.get("device_silent"):
        return ""
    return "the device sends nothing, and the tip stands still: is it in reach, and switched on?"


class FaultNews:
    """Which faults are told: each new one, and no more than one in `FAULT_NEWS`."""

    def __init__(self) -> None:
        self._told = ""
        self._next = -math.inf

    def is_new(self, fault: str, now: float) -> bool:
        """Whether a fault is to be told now.

        Args:
            fault: Fault of the loop now; empty for none.
            now: Time [s].
        """
        if not fault:
            self._told = ""
        if not fault or fault == self._told or now < self._next:
            return False
        self._told, self._next = fault, now + FAULT_NEWS
        return True


def is_real_time(scheduling: str) -> bool:
    """Whether what the system granted keeps a loop punctual beside other work.

    Args:
        scheduling: In the words of `cohaptic.runtime.scheduling.prefer_this_process`.
    """
    return "real-time" in scheduling or "high priority" in scheduling


def scheduling_in_words(scheduling: str) -> str:
    """What to tell of a loop's scheduling; empty while it is as it should be, or unknown.

    Args:
        scheduling: As `is_real_time` takes it; empty before the loop has told it.
    """
    if not scheduling or is_real_time(scheduling):
        return ""
    return (
        "the system has refused real-time scheduling to the haptic loop, so that forces may come "
        "late while the machine is busy; `cohaptic doctor` says how to allow it"
    )
