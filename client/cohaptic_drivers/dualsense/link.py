"""Connection to the pad: a thread reads the pad's reports, and sends a report when effects change.

A write waits for the USB frame, too long for the loop's thread. The thread is also a watchdog: it
switches resistance and rumble off when the loop gives no effects or the pad sends no reports.
"""

from __future__ import annotations

import contextlib
import threading

from cohaptic.clock import Clock
from cohaptic.errors import DeviceError
from cohaptic.runtime.scheduling import LOOP_PRIORITY, prefer_this_process
from cohaptic_client.devices.hid_devices import HidDevice
from cohaptic_drivers.dualsense.reports import (
    NAME,
    OFF,
    SIZE,
    Effects,
    Held,
    Side,
    decode,
    encode,
)

SILENCE = 0.02  # s; five periods of the pad; a longer silence of pad or loop switches effects off
LEAST_GAP = 0.004  # s between two reports to the pad
_WAIT = 4  # ms to wait for a report
_MAX_STALE = 128  # reports that one turn reads at most; twice the queue of Linux
_MAX_BAD = 20  # invalid reports in a row
_JOIN = 0.25  # s for the thread to end


class PadLink:
    """Connection to a pad, with a thread of its own.

    Args:
        device: Open device; this object closes it.
        side: Trigger that presses.
        clock: Clock that times the silence of pad and loop.
    """

    def __init__(self, device: HidDevice, side: Side, clock: Clock) -> None:
        self._device, self._side, self._clock = device, side, clock
        self._report: Held | None = None
        self._trouble: DeviceError | None = None
        # One value, so that the thread never sees the effects of one call with the time of another.
        self._given: tuple[Effects, float] = (OFF, clock.now())
        self._sent: Effects | None = None  # None until a report has gone to the pad
        self._bad = 0
        self._ends = False
        self._thread = threading.Thread(target=self._run, name=NAME, daemon=True)
        self._thread.start()

    def poll(self) -> Held | None:
        """Return the newest report since the last call; raise DeviceError when the pad is gone."""
        if self._trouble is not None:
            raise self._trouble
        reported, self._report = self._report, None
        return reported

    def send(self, effects: Effects) -> None:
        """Set the effects that the thread sends to the pad; raise as `poll`."""
        if self._trouble is not None:
            raise self._trouble
        self._given = (effects, self._clock.now())

    def release(self) -> None:
        """Switch all effects off; may be called from another thread."""
        self._given = (OFF, self._clock.now())

    def close(self) -> None:
        """Switch all effects off, then release the pad; may be called twice."""
        self._ends = True
        if threading.current_thread() is not self._thread:
            self._thread.join(_JOIN)

    def _run(self) -> None:
        prefer_this_process(LOOP_PRIORITY)  # the thread that started this one may have a lower one
        try:
            heard = written = self._clock.now()
            while not self._ends:
                spoke, now = self._take(), self._clock.now()
                heard = now if spoke else heard
                effects, at = self._given
                if now - at > SILENCE or now - heard > SILENCE:
                    effects = OFF
                if effects != self._sent and (self._sent is None or now - written >= LEAST_GAP):
                    written = now
                    self._write(effects)
        except OSError as error:
            advice = "plug it in again, then start again"
            self._trouble = DeviceError(NAME, f"it was unplugged ({error})", advice)
        except DeviceError as error:
            self._trouble = error
        except Exception as error:
            self._trouble = DeviceError(NAME, f"its driver failed: {error!r}")
        for _ in range(2):  # the second is tried even if the first fails: it may succeed
            with contextlib.suppress(Exception):
                self._write(OFF)
        with contextlib.suppress(Exception):
            self._device.close()

    def _take(self) -> bool:
        """Read the queued reports and keep the newest; return whether a valid report came."""
        report, spoke = self._device.read(SIZE, _WAIT), False
        for _ in range(_MAX_STALE):
            if not report:
                break
            reported = decode(report, self._side)
            self._bad = 0 if reported is not None else self._bad + 1
            if self._bad >= _MAX_BAD:
                raise DeviceError(NAME, "what comes from it is no report of a DualSense")
            spoke = spoke or reported is not None
            self._report = reported or self._report
            report = self._device.read(SIZE)
        return spoke

    def _write(self, effects: Effects) -> None:
        if self._device.write(encode(effects, self._side)) < 0:
            raise OSError("write failed")
        self._sent = effects
