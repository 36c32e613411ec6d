"""The Haply Inverse3 as a device of the loop, and the functions that find and open one."""

from __future__ import annotations

from dataclasses import replace
from typing import NoReturn

from cohaptic.clock import Clock, SystemClock
from cohaptic.errors import DeviceError, SettingError
from cohaptic.vec import Vec3
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig, DeviceKind, Found
from cohaptic_client.devices.placing.options import PLACING_OPTIONS, clutch_of, place, placed_info
from cohaptic_client.devices.placing.placed import Placed
from cohaptic_drivers.haply.exchange import GIVE_UP, SILENCE, Exchange, Heard, check_status
from cohaptic_drivers.haply.messages import (
    HELLO,
    Arm,
    GarbledReport,
    Report,
    decode,
    knows_service,
)
from cohaptic_drivers.haply.service import Service, ServiceGone, ServiceSilent

_NAME = "haply"
# Addresses of the service: the first is that of the overview of version 3.5, the second the default
# in the settings of the service and in version 3.4.
URLS = ("ws://127.0.0.1:10001", "ws://127.0.0.1:10000")
_FIRST_ANSWER = 1.0  # s

# Force, stiffness and workspace come from another project's driver; they are no rating by the
# maker. The latency is the age of a state when a force answers it: one period of the loop.
INFO = DeviceInfo(
    _NAME, max_force=10.0, max_stiffness=1000.0, max_damping=6.0, latency=0.001, lets_go=SILENCE
)
# m; middle of the workspace, from the mounting plate at the back of the device.
MIDDLE: Vec3 = (0.0, 0.15, 0.20)


class Inverse3:
    """An Inverse3 in its own frame: right, away from the user, up; origin at the mounting plate.

    Args:
        exchange: Thread that exchanges messages about the device; this object ends it.
        clock: The clock of the exchange.
    """

    def __init__(self, exchange: Exchange, clock: Clock, info: DeviceInfo = INFO) -> None:
        self.info = info
        self._exchange, self._clock = exchange, clock
        self._closed = False

    def read(self, now: float) -> DeviceSample:
        """Return the newest state of the tip; it is not fresh while the service is silent.

        Raises:
            DeviceError: The device or its service is gone, or the device cannot give force.
        """
        self._check()
        heard = self._exchange.heard
        age = self._clock.now() - heard.at
        if age > GIVE_UP + SILENCE:
            raise DeviceError(
                _NAME,
                f"device {heard.arm.id} has been silent for {1e3 * age:.0f} ms",
                "see whether it is still plugged in",
            )
        arm = heard.arm
        return DeviceSample(
            arm.position, arm.velocity, buttons=int(heard.button), fresh=age <= SILENCE
        )

    def write(self, force: Vec3) -> None:
        """Send `force` [N] with the next message; raise as `read`."""
        self._check()
        self._exchange.send(force)

    def release(self) -> None:
        """Set the force on the hand to zero; may be called from another thread."""
        self._exchange.send((0.0, 0.0, 0.0))

    def close(self) -> None:
        """Send zero force, then end the thread of the exchange; may be called twice."""
        if not self._closed:
            self._closed = True
            self._exchange.close()

    def _check(self) -> None:
        if self._closed:
            raise DeviceError(_NAME, "it is closed", "open it again")
        if self._exchange.trouble is not None:
            raise self._exchange.trouble


def connect(choice: DeviceChoice, clock: Clock) -> tuple[Service, Report]:
    """Connect to the service; return the connection and the first report of its devices.

    Raises:
        DeviceError: Nothing answers at the address, or another program answers.
    """
    asked = choice.text("url")
    for url in (asked,) if asked else URLS:
        try:
            service = Service(url, clock)
        except ConnectionRefusedError:
            continue
        except (OSError, ServiceGone) as error:
            _not_the_service(url, str(error))
        return service, _first_report(service, url)
    tried = " nor at ".join((asked,) if asked else URLS)
    raise DeviceError(
        _NAME,
        f"the Haply service does not run: nothing answers at {tried}",
        "install and start the Haply Hub (docs.haply.co), or tell its address: haply:url=ws://...",
    )


def choose(report: Report, wanted: str) -> Arm:
    """Return the state of the device that the user chose, after a check that it can give force.

    Args:
        report: Report of the service.
        wanted: Id of the device; empty for the only one.

    Raises:
        DeviceError: There is no such device, there are several and `wanted` is empty, or the device
            cannot give force.
    """
    arms, known = report.arms, ", ".join(sorted(report.arms))
    if not arms:
        advice = "plug an Inverse3 in, and its power supply; the Haply Hub shows whether it is seen"
        raise DeviceError(_NAME, "the service runs, but sees no device", advice)
    if wanted and wanted not in arms:
        raise DeviceError(_NAME, f"there is no device {wanted}", f"the service has: {known}")
    if not wanted and len(arms) > 1:
        raise DeviceError(_NAME, f"there are several: {known}", "choose one: haply:id=...")
    arm = arms[wanted] if wanted else next(iter(arms.values()))
    check_status(arm)
    return arm


def choose_grip(report: Report, wanted: str, *, clutch: bool) -> str:
    """Return the id of the grip whose button is used; empty for none.

    A grip on another table must not be the switch of this hand. With "no", the button of the only
    grip is used, but not as the switch.

    Args:
        report: Report of the service.
        wanted: "no", "yes" for the only grip, or the id of a grip.
        clutch: Whether the clutch needs the button, even if the button is not the switch.

    Raises:
        DeviceError: There is no such grip, or there are several and `wanted` names none.
    """
    grips, known = report.grips, ", ".join(sorted(report.grips))
    if wanted not in ("no", "yes"):
        if wanted not in grips:
            there = f"the service has: {known}" if grips else "switch it on; the service sees none"
            raise DeviceError(_NAME, f"there is no grip {wanted}", there)
        return wanted
    if wanted == "yes" and not grips:
        raise DeviceError(_NAME, "the service sees no grip", "switch it on, or leave out grip=yes")
    if len(grips) > 1 and (wanted == "yes" or clutch):
        raise DeviceError(_NAME, f"there are several grips: {known}", "name one: haply:grip=ID")
    return next(iter(grips)) if len(grips) == 1 else ""


def open_inverse3(config: DeviceConfig, clock: Clock | None = None) -> Placed:
    """Find and open the device of a configuration; raise DeviceError if that fails."""
    clock = clock or SystemClock()
    service, report = connect(config.choice, clock)
    try:
        arm = choose(report, config.choice.text("id"))
        clutch = clutch_of(config.choice) != 0
        grip = choose_grip(report, config.choice.text("grip", "no"), clutch=clutch)
        held = arm.status.get("in_use", False)
        if held and config.choice.text("in_use", "refuse") == "refuse":
            raise DeviceError(
                _NAME,
                f"device {arm.id} is in use by another program",
                "quit that program, or take the device all the same: haply:in_use=take",
            )
    except DeviceError:
        service.close()
        raise
    heard = Heard(clock.now(), arm, report.grips.get(grip, False))
    exchange = Exchange(service, arm.id, heard, clock, grip)
    return place(Inverse3(exchange, clock, _bare_info(config.choice)), config, middle=MIDDLE)


def find_arms(url: str = "") -> list[Found]:
    """Return the devices that the service sees; raise DeviceError if the service does not run."""
    choice = DeviceChoice(_NAME, (("url", url),) if url else ())
    service, report = connect(choice, SystemClock())
    service.close()
    found: list[Found] = []
    for arm in report.arms.values():
        at = f"the Haply service at {url or 'its usual address'}"
        text = str(DeviceChoice(_NAME, (*choice.options, ("id", arm.id))))
        try:
            check_status(arm)
        except DeviceError as error:
            found.append(Found(text, at, error.problem, error.advice))
            continue
        busy = "another program uses it" if arm.status.get("in_use", False) else ""
        found.append(Found(text, at, busy, "quit that program" if busy else ""))
    return found


def _first_report(service: Service, url: str) -> Report:
    """Request and return a full report; raise DeviceError if it is not from the service."""
    try:
        pushed = service.receive(_FIRST_ANSWER)
        if not knows_service(pushed):
            service.close()
            _not_the_service(url, "its first message lists no inverse3")
        return decode(service.exchange(HELLO, _FIRST_ANSWER))
    except GarbledReport as error:
        service.close()
        raise DeviceError(_NAME, f"{url} sends what is no state of a device: {error}") from error
    except ServiceSilent:
        service.close()
        _not_the_service(url, "it is silent where the service tells its devices")
    except ServiceGone as error:
        service.close()
        _not_the_service(url, str(error))


def _not_the_service(url: str, why: str) -> NoReturn:
    advice = "tell the address of the service: haply:url=ws://127.0.0.1:PORT"
    raise DeviceError(_NAME, f"what answers at {url} is not the Haply service ({why})", advice)


def _bare_info(choice: DeviceChoice) -> DeviceInfo:
    # Without `grip` there is no switch: a user who has no grip would wait for its button for ever.
    return replace(INFO, switch=choice.text("grip", "no") != "no")


def _info(choice: DeviceChoice) -> DeviceInfo:
    url = choice.text("url", URLS[0])
    if not url.startswith("ws://"):
        raise SettingError("haply:url", repr(url), "ws://HOST:PORT")
    choice.one_of("in_use", ("refuse", "take"), "refuse")
    return placed_info(choice, _bare_info(choice))


KIND = DeviceKind(
    _NAME,
    "a Haply Inverse3 or Minverse, through the Haply service",
    (
        ("id", "of the device, such as 049D, where there are several"),
        ("url", f"of the service, {URLS[0]} or {URLS[1]} if it is not given"),
        ("grip", "yes, or the id of one of several: its button is the switch that the hand holds"),
        ("in_use", "take: open it although another program uses it"),
        *PLACING_OPTIONS,
    ),
    _info,
    open_inverse3,
    find_arms,
)
