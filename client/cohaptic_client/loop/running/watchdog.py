"""A second thread that releases the device if a call of its driver holds up the loop.

A driver call that does not return leaves the last force on the hand. If the device offers
`release`, this thread calls it. If the loop hangs for `GIVE_UP`, the thread ends the process; the
device's own firmware then receives no more forces and takes the last one away.
"""

from __future__ import annotations

import contextlib
import math
import os
import threading
from collections.abc import Callable
from typing import Final, Protocol, runtime_checkable

from cohaptic.clock import Clock
from cohaptic.runtime.scheduling import LOOP_PRIORITY, prefer_this_process

LOOK: Final = 0.005  # s between looks at the loop: a quarter of `SafetyLimits.stall`
# s; twice a reasonable time-out of a driver's USB transfer. Reasoned, not measured.
GIVE_UP: Final = 2.0
HELD: Final = 3  # exit status of a process that was ended because a device call did not return


@runtime_checkable
class Releasable(Protocol):
    """A device that another thread can release while the loop's thread hangs in a call."""

    def release(self) -> None:
        """Take the force off the hand at once, without waiting for a call that is under way."""
        ...


class Watchdog:
    """Watches how long the calls of one device take.

    Args:
        device: Device to be released.
        clock: Clock of the loop.
        limit: Longest duration of a device call; a longer call is a stall [s].
        end: Function that ends the process with an exit status.

    Attributes:
        since: Time at which the loop began its present period [s]; inf between two periods. The
            loop writes it.
        fired: Whether the device was released in the present period. The loop reads and clears it.
    """

    def __init__(
        self,
        device: Releasable,
        clock: Clock,
        limit: float,
        end: Callable[[int], object] = os._exit,
    ) -> None:
        self.since = math.inf
        self.fired = False
        self._device, self._clock, self._limit, self._end = device, clock, limit, end
        self._stopped = False
        # A daemon thread, so that the end of the process does not wait for it.
        self._thread = threading.Thread(target=self._run, name="watchdog", daemon=True)

    def start(self) -> None:
        """Start the watching thread."""
        self._thread.start()

    def stop(self) -> None:
        """Let the watching thread end."""
        self._stopped = True

    def begin(self) -> None:
        """Begin to measure the duration of a device call."""
        self.since = self._clock.now()

    def end(self) -> None:
        """End the measurement: the device call has returned."""
        self.since = math.inf

    def look(self) -> None:
        """Release the device if a call has hung for `limit`; end the process after `GIVE_UP`."""
        hung = self._clock.now() - self.since
        if hung <= self._limit:
            return
        if not self.fired:
            self.fired = True  # before the release, so that the loop does not give the old force
            # In its own thread: `release` may wait for the same transfer as the loop.
            releasing = threading.Thread(target=self._release, name="release", daemon=True)
            releasing.start()
            releasing.join(LOOK)
        elif hung > GIVE_UP:
            self._end(HELD)

    def _release(self) -> None:
        with contextlib.suppress(Exception):
            self._device.release()

    def _run(self) -> None:
        # Above the loop's priority: a loop that spins would else keep this thread from running.
        prefer_this_process(LOOP_PRIORITY + 1)
        while not self._stopped:
            self._clock.sleep_until(self._clock.now() + LOOK)
            self.look()
