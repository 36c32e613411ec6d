"""The network process's control of the loop's process: start it, exchange values, end it."""

from __future__ import annotations

import contextlib
import json
import signal
import subprocess
import sys
import threading
from typing import NamedTuple

from cohaptic.errors import DeviceError
from cohaptic.status.row import Row, last_row
from cohaptic.vec import Vec3
from cohaptic_client.devices.catalogue import device_info
from cohaptic_client.loop.config import LoopConfig
from cohaptic_client.loop.memory import COMMAND, SAMPLE, LoopMemory
from cohaptic_client.loop.running.watchdog import HELD
from cohaptic_client.loop.safety import SAFETY_FADE_RATE

# s for the loop to end by itself once the force has faded: enough to close a device, and a user
# does not wait much longer. Reasoned, not measured.
_GRACE = 2.0


class TipSample(NamedTuple):
    """Position of the tip and force of the loop's newest period, for the server.

    Args:
        t: Time of the period, on the client's clock [s].
        tick: Tick of the patch that the period used; 0 for none.
        probe: Position of the tip [m].
        force: Force on the hand without the damping of the passivity layer; the body gets the
            opposite force [N].
        anchor: Point of the resting surface to which friction holds the finger [m]; None for none.
        deflection: Displacement of the own hand's model before that force [m]; None without models.
    """

    t: float
    tick: int
    probe: Vec3
    force: Vec3
    anchor: Vec3 | None
    deflection: float | None


class HapticProcess:
    """The process of the haptic loop, as the network process starts and controls it.

    Args:
        passed: Device and rules of a script, as `loop.passed` packs them; empty for none.

    Attributes:
        status: Newest report of the loop; empty before the first.
        stopping: Whether `request_stop` has told the loop to end.
        every_row: Whether the loop writes the row of every period, from the next heartbeat on.
    """

    def __init__(self, config: LoopConfig, memory: LoopMemory, passed: bytes = b"") -> None:
        self._memory = memory
        choice = config.device.choice
        self._device = device_info(choice).name if config.passed else choice.name
        self._grace = _GRACE + config.limits.max_force / SAFETY_FADE_RATE
        self._beats = 0
        self._acknowledged = 0
        self._last: TipSample | None = None
        self.stopping = False
        self.every_row = config.every_row
        self.status: dict[str, object] = {}
        command = [sys.executable, "-m", "cohaptic_client.loop.process", config.to_json()]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE if passed else subprocess.DEVNULL
        )
        if passed:
            # By a pipe, which no other program can write to; in a thread, because it fills up
            # before the process reads.
            threading.Thread(target=self._pass, args=(passed,), daemon=True).start()

    def _pass(self, passed: bytes) -> None:
        assert self._process.stdin is not None
        # A process that has ended reports that itself.
        with contextlib.suppress(OSError), self._process.stdin as pipe:
            pipe.write(passed)

    def give_patch(self, frame: bytes) -> None:
        """Pass the frame of the newest patch to the loop."""
        self._memory.patch.write(frame)

    def newest_sample(self) -> TipSample | None:
        """Return the tip and force of the newest period; None before the first period."""
        raw = self._memory.sample.read()
        if raw is not None:
            t, tick, x, y, z, fx, fy, fz, holds, ax, ay, az, deflections, deflection = (
                SAMPLE.unpack(raw)
            )
            anchor = (ax, ay, az) if holds else None
            self._last = TipSample(
                t, tick, (x, y, z), (fx, fy, fz), anchor, deflection if deflections else None
            )
        return self._last

    def newest_row(self) -> Row | None:
        """Return the row of the newest period; None before the first."""
        raw = self._memory.rows.newest()
        return last_row(raw) if raw else None

    @property
    def lost_rows(self) -> int:
        """Number of rows that `new_rows` came too late for."""
        return self._memory.rows.lost

    def new_rows(self) -> bytes:
        """Return the rows since the last call, as a block for `cohaptic.status.row.rows_in`."""
        return self._memory.rows.read_new()

    def beat(self) -> None:
        """Send a heartbeat to the loop, and read its report.

        Raises:
            DeviceError: The loop has ended because of its device, or died.
        """
        if self.stopping:
            return
        self._command(stop=False)
        # Poll for the end before reading the report, so that the last report explains the end.
        ended = self._process.poll()
        self.read_status()
        trouble = self.status.get("error")
        if trouble is not None:
            raise DeviceError(self._device, str(trouble).removeprefix(f"{self._device}: "))
        if ended is not None:
            raise DeviceError(self._device, *_end_in_words(ended))

    def acknowledge(self) -> None:
        """Tell the loop that the user has acknowledged its fault."""
        self._acknowledged += 1
        if not self.stopping:
            self._command(stop=False)

    def request_stop(self) -> None:
        """Tell the loop to fade the force to zero and end."""
        self.stopping = True
        self._command(stop=True)

    def wait(self) -> None:
        """Wait until the loop has ended; kill it after a time-out. Call `request_stop` first."""
        try:
            self._process.wait(self._grace)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _command(self, *, stop: bool) -> None:
        self._beats += 1
        command = COMMAND.pack(self._beats, stop, self.every_row, self._acknowledged)
        self._memory.command.write(command)

    def read_status(self) -> None:
        """Read the loop's newest report into `status`."""
        raw = self._memory.status.read()
        if raw is not None:
            self.status = json.loads(raw)


def _end_in_words(status: int) -> tuple[str, str]:
    """Return problem and advice for a process that ended without reporting an error."""
    if status == HELD:
        return (
            "it held up its loop until that was ended",
            "unplug it and plug it in, then start again",
        )
    if status < 0:
        return f"its process was ended by {signal.Signals(-status).name}", "start again"
    return f"its process ended with {status}", "start again"
