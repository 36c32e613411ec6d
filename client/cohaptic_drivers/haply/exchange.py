"""The thread that sends forces to the Haply service and keeps the newest state of the device.

The service holds a force until the next one comes, so this thread is also a watchdog: it sends zero
force when the loop has given no force for `SILENCE`, and when the thread ends for any reason.
"""

from __future__ import annotations

import contextlib
import threading
from dataclasses import dataclass

from cohaptic.clock import Clock
from cohaptic.errors import DeviceError
from cohaptic.runtime.scheduling import LOOP_PRIORITY, prefer_this_process
from cohaptic.vec import ZERO, Vec3
from cohaptic_drivers.haply.messages import Arm, GarbledReport, Report, decode, force_message
from cohaptic_drivers.haply.service import Service, ServiceGone, ServiceSilent

SILENCE = 0.02  # s; after a longer silence of the service or of the loop the hand feels no force
GIVE_UP = 0.25  # s; a device that has been silent for longer counts as gone
_FAREWELLS = 2  # messages with zero force at the end: the answer to the first may be missing
# s; time for an answer that does not come, for the last messages after it, and for a busy machine.
LONGEST_CLOSE = GIVE_UP + (_FAREWELLS + 2) * SILENCE
# One garbled message may be a slip of the service; several in a row do not come from a device.
_MAX_GARBLED = 5


@dataclass(frozen=True, slots=True)
class Heard:
    """The newest state of the device, and the time at which it arrived.

    Args:
        at: Time of arrival, on the clock of the exchange [s].
        arm: State of the device.
        button: Whether a button of the chosen grip is pressed.
    """

    at: float
    arm: Arm
    button: bool


class Exchange:
    """Sends forces to one device and receives its states, in a thread of its own.

    Args:
        service: Open connection to the service; this object closes it.
        device: Id of the device.
        first: State of the device at the start.
        grip: Id of the grip whose button is used; empty for none.

    Attributes:
        heard: The newest state of the device.
        trouble: Error that ended the thread; None while it runs.
        answers: Number of messages that the service has answered.
    """

    def __init__(
        self, service: Service, device: str, first: Heard, clock: Clock, grip: str
    ) -> None:
        self._service, self._device, self._clock, self._grip = service, device, clock, grip
        self.heard = first
        self.trouble: DeviceError | None = None
        self.answers = 0
        self._force = ZERO
        self._garbled = 0
        # The lock is held while there is nothing to send; its release wakes the thread. An `Event`
        # would take ten times as long in the loop's period.
        self._idle = threading.Lock()
        self._idle.acquire()
        self._ends = False
        self._thread = threading.Thread(target=self._run, name="haply", daemon=True)
        self._thread.start()

    def send(self, force: Vec3) -> None:
        """Set the force [N] that the next message sends; return at once."""
        self._force = force
        self._wake()

    def close(self) -> None:
        """Send zero force, then end the thread; this waits for `LONGEST_CLOSE` at most."""
        self._force, self._ends = ZERO, True
        self._wake()
        if threading.current_thread() is not self._thread:
            self._thread.join(LONGEST_CLOSE)
        self._service.close()

    def _wake(self) -> None:
        with contextlib.suppress(RuntimeError):  # the thread is awake already
            self._idle.release()

    def _run(self) -> None:
        prefer_this_process(LOOP_PRIORITY)  # the thread that started this one may have a lower one
        try:
            while not self._ends:
                woken = self._idle.acquire(timeout=SILENCE)
                # A loop that stands still gets zero; a force that it gives now goes out next turn.
                self._turn(self._force if woken else ZERO)
        except ServiceGone as error:
            why = f"the connection to the Haply service broke in use ({error})"
            self._end(why, "start the service again, then this program")
        except ServiceSilent:
            why = f"the Haply service has not answered for {1e3 * GIVE_UP:.0f} ms"
            self._end(why, "see whether its device is still plugged in")
        except GarbledReport as error:
            self._end(f"the Haply service sends what is no state of a device: {error}")
        except DeviceError as error:
            self._end(error.problem, error.advice)
        except Exception as error:
            self._end(f"its driver failed: {error!r}")
        for _ in range(_FAREWELLS):
            with contextlib.suppress(Exception):
                self._service.exchange(force_message(self._device, ZERO), SILENCE)

    def _turn(self, force: Vec3) -> None:
        """Send one message and wait even for a late answer: each message has exactly one answer."""
        text = self._service.exchange(force_message(self._device, force), GIVE_UP)
        while self._service.waiting():  # the service has sent more than one answer
            text = self._service.receive(SILENCE)
        self.answers += 1
        try:
            report = decode(text, self._device)
        except GarbledReport:
            self._garbled += 1
            if self._garbled >= _MAX_GARBLED:
                raise
            return
        self._garbled = 0
        self._learn(report)

    def _learn(self, report: Report) -> None:
        now = self._clock.now()
        arm = report.arms.get(self._device)
        if arm is not None:
            check_status(arm)
            self.heard = Heard(now, arm, report.grips.get(self._grip, False))
        elif now - self.heard.at > GIVE_UP:
            raise DeviceError("haply", f"device {self._device} was unplugged", "plug it in again")

    def _end(self, problem: str, advice: str = "") -> None:
        self._force = ZERO
        self.trouble = DeviceError("haply", problem, advice)


def check_status(arm: Arm) -> None:
    """Raise DeviceError, with advice, if a device cannot give force."""
    status = arm.status
    if not status.get("power_supply", True):
        raise DeviceError(
            "haply",
            f"device {arm.id} has no power: it senses, and gives no force",
            "plug its power supply in",
        )
    if not status.get("calibrated", True):
        raise DeviceError(
            "haply",
            f"device {arm.id} is not calibrated",
            "put its arms into the resting position and calibrate it in the Haply Hub",
        )
    if not (status.get("started", True) and status.get("ready", True)):
        raise DeviceError(
            "haply",
            f"device {arm.id} is not ready",
            "wait until the Haply Hub shows it as ready, or plug it in again",
        )
    if arm.frame:
        raise DeviceError(
            "haply",
            f"the service speaks of device {arm.id} in another frame: {arm.frame}",
            "set basis and transform of the device back in the Haply Hub",
        )
