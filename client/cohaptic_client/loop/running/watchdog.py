"""A second thread that lets a device go which holds up the loop.

A call of a driver that does not return leaves the last force on the hand. Where the device offers
`release`, this thread calls it; a loop that hangs for `GIVE_UP` is ended with its process, and the
device's own firmware, which hears nothing any more, does the rest.
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
GIVE_UP: Final = 2.0  # s; twice what a driver may reasonably wait for a USB transfer to time out
HELD: Final = 3  # exit status of a process whose device never came back


@runtime_checkable
class Releasable(Protocol):
    """A device that another thread can let go while the loop's hangs in `read` or `write`."""

    def release(self) -> None:
        """Take the force off the hand, at once; never waits for a call that is under way."""
        ...


class Watchdog:
    """Watches over the calls of one device.

    Args:
        device: To be released.
        clock: Clock of the loop.
        limit: A call that takes longer is a stall [s].
        end: Ends the process with a status.

    Attributes:
        since: When the loop began its present period [s]; inf between two. The loop writes it.
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
        # A daemon: a process that ends waits for nobody.
        self._thread = threading.Thread(target=self._run, name="watchdog", daemon=True)

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def stop(self) -> None:
        """Look no more."""
        self._stopped = True

    def begin(self) -> None:
        """From now on the time of a call of the device counts."""
        self.since = self._clock.now()

    def end(self) -> None:
        """The call is over."""
        self.since = math.inf

    def look(self) -> None:
        """Release the device if the loop hangs; end the process if it has for too long."""
        hung = self._clock.now() - self.since
        if hung <= self._limit:
            return
        if not self.fired:
            self.fired = True  # first: the loop must not give the old force again
            # In a thread of its own: it may wait for the very transfer that the loop waits for.
            releasing = threading.Thread(target=self._release, name="release", daemon=True)
            releasing.start()
            releasing.join(LOOK)
        elif hung > GIVE_UP:
            self._end(HELD)

    def _release(self) -> None:
        with contextlib.suppress(Exception):
            self._device.release()

    def _run(self) -> None:
        # Before the loop's own: one that spins at its priority would keep this thread from looking.
        prefer_this_process(LOOP_PRIORITY + 1)
        while not self._stopped:
            self._clock.sleep_until(self._clock.now() + LOOK)
            self.look()
