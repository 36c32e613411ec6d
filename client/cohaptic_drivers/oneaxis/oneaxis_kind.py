"""One-axis handles as the catalogue knows them; functions that find, open and calibrate one."""

from __future__ import annotations

import math
from collections.abc import Callable

from cohaptic.clock import Clock, SystemClock
from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig, DeviceKind, Found
from cohaptic_client.devices.placing.options import PLACING_OPTIONS, place, placed_info, turn_of
from cohaptic_client.devices.placing.placed import Placed
from cohaptic_drivers.oneaxis.calibration import calibrate
from cohaptic_drivers.oneaxis.frames import NAME
from cohaptic_drivers.oneaxis.handle import Handle, handle_info
from cohaptic_drivers.oneaxis.link import find_ports, open_board
from cohaptic_drivers.oneaxis.unit import read_unit

_AWAY: Vec3 = (0.0, 1.0, 0.0)
_DOWN: Vec3 = (0.0, 0.0, -1.0)


def open_oneaxis(config: DeviceConfig, clock: Clock | None = None) -> Placed:
    """Find and open the handle of a configuration; raise DeviceError if that fails."""
    clock, choice = clock or SystemClock(), config.choice
    unit, force = read_unit(choice.text("unit")), _with_force(choice)
    link, board, first = open_board(_path_of(choice), clock)
    try:
        handle = Handle(unit, link, board, first, axis=_axis_of(choice), force=force)
    except DeviceError:
        link.close()
        raise
    return place(handle, config, middle=ZERO)


def find_boards() -> list[Found]:
    """Return the boards of this machine; each is opened to read its description.

    Raises:
        DeviceError: pyserial is missing.
    """
    found: list[Found] = []
    for path in (port.device for port in find_ports()):
        text = f"{NAME}:port={path}"
        try:
            link, _, first = open_board(path, SystemClock())
        except DeviceError as error:
            found.append(Found(text, path, error.problem, error.advice))
            continue
        link.close()
        broken = "its board says that its sensor failed" if first.faulty else ""
        found.append(Found(text, path, broken, "see to its magnet and its cable" if broken else ""))
    return found


def calibrate_oneaxis(choice: DeviceChoice, clock: Clock, ask: Callable[[str], None]) -> list[str]:
    """Measure a handle and return the lines of its file; raise DeviceError as `calibrate`."""
    link, board, _ = open_board(_path_of(choice), clock)
    try:
        return calibrate(link, board, clock, ask)
    finally:
        link.close()


def _path_of(choice: DeviceChoice) -> str:
    path = choice.text("port")
    if path:
        return path
    ports = [port.device for port in find_ports()]
    if not ports:
        advice = f"plug it in, or name its port: {NAME}:port=..."
        raise DeviceError(NAME, "no serial port of such a board was found", advice)
    if len(ports) > 1:
        advice = f"choose one: {NAME}:port=..."
        raise DeviceError(NAME, f"there are several ports: {', '.join(ports)}", advice)
    return str(ports[0])


def _with_force(choice: DeviceChoice) -> bool:
    return choice.one_of("force", ("on", "off"), "on") == "on"


def _axis_of(choice: DeviceChoice) -> Vec3:
    """Return the direction in which the hand presses, in the device's frame."""
    return _DOWN if choice.text("place") == "top" else _AWAY


def _knock(choice: DeviceChoice) -> Vec3:
    """Return the direction of a knock in the world: along the axis, toward the hand."""
    if _axis_of(choice) == _DOWN:
        return (0.0, 0.0, 1.0)
    turn = turn_of(choice)
    return (math.sin(turn), -math.cos(turn), 0.0)


def _info(choice: DeviceChoice) -> DeviceInfo:
    info = handle_info(read_unit(choice.text("unit")), force=_with_force(choice))
    return placed_info(choice, info)


KIND = DeviceKind(
    NAME,
    "a handle on one motor, such as a Hapkit, with the firmware of examples/one_axis_board",
    (
        ("port", "of its board, where there are several, such as /dev/ttyUSB0"),
        ("unit", "TOML file of the handle at hand, without which it senses only"),
        ("force", "off: its motor stays off, to try directions"),
        *PLACING_OPTIONS,
    ),
    _info,
    open_oneaxis,
    find_boards,
    knock=_knock,
    calibrate=calibrate_oneaxis,
)
