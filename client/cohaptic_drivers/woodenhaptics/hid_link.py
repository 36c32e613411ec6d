"""Connection to the HID boards: a thread of its own reads a report and writes one, in turn.

A write waits for the USB frame, a millisecond and now and then several: too long for the loop's
thread. The thread is also a watchdog: it sends zero currents when the loop gives none.
"""

from __future__ import annotations

import contextlib
import threading

from cohaptic.clock import Clock
from cohaptic.errors import DeviceError
from cohaptic.runtime.scheduling import LOOP_PRIORITY, prefer_this_process
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.hid_devices import Entry, HidDevice, hidapi, open_first
from cohaptic_drivers.woodenhaptics.arm import NAME, SILENCE
from cohaptic_drivers.woodenhaptics.reports import GENERATIONS, Reported, Reports, input_size

# Vendor and product: the defaults of the mbed library, and those of a Teensy's raw HID.
PRODUCTS = ((0x1234, 0x0006), (0x16C0, 0x0486))

_WAIT = 10  # ms to wait for a report; then a command prompts the board
# s; silence of the board after which it gets zero currents. The loop notices after `SILENCE` and
# has let the hand go without a jerk by then; a report that is late by less costs no force.
_LOST = 0.03
_MAX_STALE = 128  # reports that one turn reads at most; twice the queue of Linux
_MAX_BAD = 20  # invalid reports in a row
_JOIN = 0.25  # s for the thread to end


class HidLink:
    """Connection to a HID board, with a thread of its own.

    Args:
        device: Open device; this object closes it.
        reports: Layout of the board's reports.
        clock: Clock that times the silence of the loop and of the board.
    """

    def __init__(self, device: HidDevice, reports: Reports, clock: Clock) -> None:
        self._device, self._reports, self._clock = device, reports, clock
        self._report: Reported | None = None
        self._trouble: DeviceError | None = None
        self._given, self._at = ZERO, clock.now()
        self._bad = 0
        self._ends = False
        self._thread = threading.Thread(target=self._run, name=NAME, daemon=True)
        self._thread.start()

    def poll(self, now: float) -> Reported | None:
        """Return the newest report since the last call; raise DeviceError if the board is gone."""
        if self._trouble is not None:
            raise self._trouble
        reported, self._report = self._report, None
        return reported

    def send(self, milliamps: Vec3) -> None:
        """Set the currents [mA] that the next report sends; raise as `poll`."""
        if self._trouble is not None:
            raise self._trouble
        self._given, self._at = milliamps, self._clock.now()

    def release(self) -> None:
        """Send zero currents with the next report; may be called from another thread."""
        self._given = ZERO

    def close(self) -> None:
        """Send zero currents, then release the board; may be called twice."""
        self._ends = True
        if threading.current_thread() is not self._thread:
            self._thread.join(_JOIN)

    def _run(self) -> None:
        prefer_this_process(LOOP_PRIORITY)  # the thread that started this one may have a lower one
        try:
            heard = self._clock.now()
            while not self._ends:
                spoke, now = self._take(), self._clock.now()
                heard = now if spoke else heard
                idle = now - self._at > SILENCE or now - heard > _LOST
                self._write(ZERO if idle else self._given)
        except OSError as error:
            advice = "plug it in again, then start again"
            self._trouble = DeviceError(NAME, f"it was unplugged ({error})", advice)
        except DeviceError as error:
            self._trouble = error
        except Exception as error:
            self._trouble = DeviceError(NAME, f"its driver failed: {error!r}")
        with contextlib.suppress(Exception):
            for _ in range(2):
                self._write(ZERO)
        with contextlib.suppress(Exception):
            self._device.close()

    def _take(self) -> bool:
        """Read the queued reports and keep the newest; return whether the board sent a report.

        A board that waits for the host must get a command before it sends its first report.
        """
        size = self._reports.size
        report, spoke = self._device.read(size, _WAIT), False
        for _ in range(_MAX_STALE):
            if not report:
                return spoke
            spoke = True
            reported = self._reports.decode(bytes(report))
            self._bad = 0 if reported is not None else self._bad + 1
            if self._bad >= _MAX_BAD:
                raise DeviceError(NAME, "what comes from its board is no report of it")
            self._report = reported or self._report
            if self._reports.waits:
                return True
            report = self._device.read(size)
        return True

    def _write(self, milliamps: Vec3) -> None:
        if self._device.write(self._reports.encode(milliamps)) < 0:
            raise OSError("write failed")


def hid_boards() -> list[Entry]:
    """List the HID interfaces of this machine that have the USB ids of such boards."""
    hid = hidapi(NAME)
    return [entry for vendor, product in PRODUCTS for entry in hid.enumerate(vendor, product)]


def open_hid(generation: str, number: int, clock: Clock) -> tuple[HidLink, Reports]:
    """Open a HID board of this machine; return its connection and the layout of its reports.

    Args:
        generation: Name of the board's generation, or "auto" to recognise it by the length of its
            reports.
        number: Number of the board if there are several, from 1.
        clock: Clock for the connection.

    Raises:
        DeviceError: There is no such board, this user may not open it, or it is another device.
    """
    entries = hid_boards()
    if not entries:
        raise DeviceError(NAME, "no board was found", "plug it in, and switch its power on")
    if not 1 <= number <= len(entries):
        raise DeviceError(NAME, f"there is no board {number}", f"boards are 1 to {len(entries)}")
    device, _ = open_first(NAME, "a board", [entries[number - 1]])
    size = input_size(bytes(device.get_report_descriptor()))
    known = {reports.size: reports for reports in GENERATIONS.values()}
    reports = known.get(size)
    if reports is None or generation not in ("auto", reports.name):
        device.close()
        wanted = "8, 14 or 64" if reports is None else f"{GENERATIONS[generation].size}"
        problem = f"what has its USB id sends reports of {size} bytes, not of {wanted}"
        raise DeviceError(NAME, problem, "it is another device, or another generation: board=auto")
    return HidLink(device, reports, clock), reports
