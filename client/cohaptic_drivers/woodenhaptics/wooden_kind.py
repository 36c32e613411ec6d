"""The arms of this family as the catalogue knows them; functions that find and open them."""

from __future__ import annotations

from cohaptic.clock import Clock, SystemClock
from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.hid_devices import try_hid
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig, DeviceKind, Found
from cohaptic_client.devices.placing.options import PLACING_OPTIONS, place, placed_info
from cohaptic_client.devices.placing.placed import Placed
from cohaptic_drivers.woodenhaptics.arm import (
    NAME,
    SERIAL_LETS_GO,
    SILENCE,
    Link,
    WoodenArm,
    arm_info,
)
from cohaptic_drivers.woodenhaptics.hid_link import hid_boards, open_hid
from cohaptic_drivers.woodenhaptics.reports import GENERATIONS, Reported
from cohaptic_drivers.woodenhaptics.serial_link import find_ports, open_serial
from cohaptic_drivers.woodenhaptics.unit import UNITS, Unit, read_unit

_BOARDS = ("serial", "auto", *GENERATIONS)
_FIRST_REPORT = 1.0  # s


def open_wooden(config: DeviceConfig, clock: Clock | None = None) -> Placed:
    """Find and open the arm of a configuration; raise DeviceError if that fails."""
    clock, choice = clock or SystemClock(), config.choice
    unit, force = _unit_of(choice), _with_force(choice)
    switch, lets_go = False, SERIAL_LETS_GO
    if choice.one_of("board", _BOARDS, "serial") == "serial":
        link, first = _serial_board(choice, unit, clock)
    else:
        if force and not unit.confirmed:
            # With a wrong direction a spring pushes the hand on and on.
            raise DeviceError(
                NAME,
                "the older boards differ in the directions of their motors",
                "try it with force=off, write its directions into a file, and tell it: unit=FILE",
            )
        number = int(choice.number("number", 1, 1, 16))
        link, reports = open_hid(choice.text("board"), number, clock)
        first, switch, lets_go = _first_report(link, clock), reports.waits, SILENCE
    try:
        here = choice.one_of("home", ("counters", "here"), "counters") == "here"
        arm = WoodenArm(
            unit, link, first, force=force, home_here=here, switch=switch, lets_go=lets_go
        )
    except DeviceError:
        link.close()
        raise
    return place(arm, config, middle=ZERO)


def _serial_board(choice: DeviceChoice, unit: Unit, clock: Clock) -> tuple[Link, Reported]:
    path = choice.text("port")
    if not path:
        ports = [port.device for port in find_ports()]
        if not ports:
            advice = "plug it in; a board of before 2022 is chosen with board=auto"
            raise DeviceError(NAME, "no serial board was found", advice)
        if len(ports) > 1:
            advice = "choose one: woodenhaptics:port=..."
            raise DeviceError(NAME, f"there are several boards: {', '.join(ports)}", advice)
        path = ports[0]
    link, first = open_serial(path, clock)
    if first.model != unit.model:
        link.close()
        names = [name for name, each in UNITS.items() if each.model == first.model]
        advice = f"choose it: woodenhaptics:kind={names[0]}" if names else "kinds are 1 to 3"
        raise DeviceError(NAME, f"the board at {path} says that it is kind {first.model}", advice)
    return link, first


def _first_report(link: Link, clock: Clock) -> Reported:
    end = clock.now() + _FIRST_REPORT
    while clock.now() < end:
        reported = link.poll(clock.now())
        if reported is not None:
            return reported
        clock.sleep_until(clock.now() + 0.001)
    link.close()
    raise DeviceError(NAME, "its board sends no reports", "see that its firmware is loaded")


def _unit_of(choice: DeviceChoice) -> Unit:
    kind = choice.one_of("kind", UNITS, "woodenhaptics")
    return read_unit(kind, choice.text("unit"))


def _with_force(choice: DeviceChoice) -> bool:
    return choice.one_of("force", ("on", "off"), "on") == "on"


def _info(choice: DeviceChoice) -> DeviceInfo:
    board = choice.one_of("board", _BOARDS, "serial")
    choice.one_of("home", ("counters", "here"), "counters")
    choice.number("number", 1, 1, 16)
    switch = board in GENERATIONS and GENERATIONS[board].waits
    lets_go = SERIAL_LETS_GO if board == "serial" else SILENCE
    info = arm_info(_unit_of(choice), force=_with_force(choice), switch=switch, lets_go=lets_go)
    return placed_info(choice, info)


def find_arms() -> list[Found]:
    """Return the boards of this machine; each is opened to test it.

    Raises:
        DeviceError: pyserial or hidapi is missing.
    """
    return [*_find_serial([port.device for port in find_ports()]), *_find_hid()]


def _find_serial(paths: list[str]) -> list[Found]:
    found: list[Found] = []
    for path in paths:
        try:
            link, first = open_serial(path, SystemClock())
        except DeviceError as error:
            found.append(Found(f"{NAME}:port={path}", path, error.problem, error.advice))
            continue
        link.close()
        names = [name for name, unit in UNITS.items() if unit.model == first.model]
        text = f"{NAME}:kind={names[0]},port={path}" if names else f"{NAME}:port={path}"
        unknown = "" if names else f"its board says that it is kind {first.model}"
        found.append(Found(text, path, unknown, "kinds are 1 to 3" if unknown else ""))
    return found


def _find_hid() -> list[Found]:
    found: list[Found] = []
    for number, entry in enumerate(hid_boards(), start=1):
        where = entry["path"].decode(errors="replace")
        text = f"{NAME}:board=auto,number={number},unit=FILE"
        found.append(try_hid(NAME, text, where, entry))
    return found


KIND = DeviceKind(
    NAME,
    "a WoodenHaptics, Polhem or vintage Phantom on its open board",
    (
        ("kind", "woodenhaptics, polhem or vintage"),
        ("port", "of a serial board, where there are several, such as /dev/ttyACM0"),
        ("board", "serial; for those of before 2022 h1, h2, h3, or auto"),
        ("number", "of a HID board, where there are several, from 1"),
        ("unit", "TOML file with what is special about the arm at hand"),
        ("home", "here: it is in its home pose at the start, whatever its counters say"),
        ("force", "off: its motors stay off, to try directions"),
        *PLACING_OPTIONS,
    ),
    _info,
    open_wooden,
    find_arms,
)
