"""The thread that talks with the Haply service: one message for each force, and the newest state.

The service holds a force until the next one, so this thread is a watchdog, too: it says zero when
the loop has given it nothing for `SILENCE`, and zero when it ends, whatever made it end.
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

SILENCE = 0.02  # s; a service, or a loop, that is silent for longer holds no force
GIVE_UP = 0.25  # s; a device that has been silent for longer is gone
_FAREWELLS = 2  # messages with zero force at the end: the answer to the first may be missing
# s; of an answer that does not come, the farewells after it, and a busy machine.
LONGEST_CLOSE = GIVE_UP + (_FAREWELLS + 2) * SILENCE
# One garbled message may be a slip of the service; several in a row are no device.
_MOST_GARBLED = 5


@dataclass(frozen=True, slots=True)
class Heard:
    """What was heard of the device last.

    Args:
        at: When, on the clock of the exchange [s].
        arm: Its state.
        button: Whether a button of its grip is held.
    """

    at: float
    arm: Arm
    button: bool


class Exchange:
    """The conversation about one device.

    Args:
        service: Open; this object closes it.
        device: Id of the device.
        first: Its state.
        clock: Clock of this process.
        grip: Id of the grip that is held with it; no other counts.

    Attributes:
        heard: The newest state.
        trouble: What ended the conversation; None while it goes on.
        answers: Messages that the service has answered.
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
        # Held: nothing to send. A lock as a flag that wakes the thread; `Event` takes ten times
        # as long in the loop's period.
        self._idle = threading.Lock()
        self._idle.acquire()
        self._ends = False
        self._thread = threading.Thread(target=self._run, name="haply", daemon=True)
        self._thread.start()

    def give(self, force: Vec3) -> None:
        """Have `force` [N] sent with the next message; never waits."""
        self._force = force
        self._wake()

    def close(self) -> None:
        """Zero force, then the end of the conversation; waits for `LONGEST_CLOSE` at most."""
        self._force, self._ends = ZERO, True
        self._wake()
        if threading.current_thread() is not self._thread:
            self._thread.join(LONGEST_CLOSE)
        self._service.close()

    def _wake(self) -> None:
        with contextlib.suppress(RuntimeError):  # it is awake
            self._idle.release()

    def _run(self) -> None:
        prefer_this_process(LOOP_PRIORITY)  # a thread has the priority of who started it, then
        try:
            while not self._ends:
                woken = self._idle.acquire(timeout=SILENCE)
                # Of a loop that stands still there is none; what it gives now is for the next turn.
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
        """One message, and its answer however late it is: there is exactly one to each."""
        text = self._service.exchange(force_message(self._device, force), GIVE_UP)
        while self._service.waiting():  # a service that says more than it was asked for
            text = self._service.receive(SILENCE)
        self.answers += 1
        try:
            report = decode(text, self._device)
        except GarbledReport:
            self._garbled += 1
            if self._garbled >= _MOST_GARBLED:
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
    """Raise DeviceError for a device that cannot give force, with what to do about it."""
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
