"""The DualSense as the catalogue knows it, and the functions that find and open a pad."""

from __future__ import annotations

import math

from cohaptic.clock import Clock, SystemClock
from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.hid_devices import Entry, hidapi, open_first, try_hid
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig, DeviceKind, Found
from cohaptic_client.devices.placing.options import PLACING_OPTIONS, turn_of
from cohaptic_client.devices.placing.placed import Placed
from cohaptic_client.devices.placing.workspace import Workspace
from cohaptic_drivers.dualsense.cursor import FRONT, TOP, Room
from cohaptic_drivers.dualsense.link import PadLink
from cohaptic_drivers.dualsense.pad import Pad, pad_info
from cohaptic_drivers.dualsense.reports import NAME, OFF, SIDES, Held, wireless

VENDOR = 0x054C
PRODUCTS = (0x0CE6, 0x0DF2)  # DualSense, DualSense Edge
_BLUETOOTH = 2  # value of hidapi's `bus_type`
_PLACES = {"front": FRONT, "top": TOP}
_OUTSIDE = 1.1  # times the body's radius: distance at which the tip starts, just off the body
_REACH = 2.0  # times the body's radius: distance to which the sticks move the tip
_MAX_PADS = 16
FIRST_REPORT = 1.0  # s


def open_dualsense(config: DeviceConfig, clock: Clock | None = None) -> Placed:
    """Find and open the pad of a configuration; raise DeviceError if that fails."""
    clock, choice, radius = clock or SystemClock(), config.choice, config.radius
    side = SIDES[_side_of(choice)]
    entry = _chosen(pads(), choice)
    if entry.get("bus_type") == _BLUETOOTH:
        raise wireless()
    device, _ = open_first(NAME, "a DualSense", [entry])
    link = PadLink(device, side, clock)
    first = _first_report(link, clock)
    room = Room(_PLACES[_place_of(choice)], _depth_of(choice), _REACH * radius)
    pad = Pad(link, first, room, start=-_OUTSIDE * radius, full=_full_of(choice))
    return Placed(pad, Workspace(ZERO, config.center, turn=turn_of(choice)))


def pads() -> list[Entry]:
    """List the HID interfaces of pads on this machine; raise DeviceError without hidapi."""
    hid = hidapi(NAME)
    return [entry for product in PRODUCTS for entry in hid.enumerate(VENDOR, product)]


def find_pads() -> list[Found]:
    """Return the pads of this machine, with their problems; raise DeviceError without hidapi."""
    found, entries = list[Found](), pads()
    serials = [entry["serial_number"] for entry in entries]
    for number, entry in enumerate(entries, start=1):
        serial = entry["serial_number"]
        known = serial and serials.count(serial) == 1 and not set(serial) & set(",=")
        text = f"{NAME}:serial={serial}" if known else f"{NAME}:number={number}"
        where = f"{entry['product_string']} at {entry['path'].decode(errors='replace')}"
        if entry.get("bus_type") == _BLUETOOTH:
            trouble = wireless()
            found.append(Found(text, where, trouble.problem, trouble.advice))
        else:
            found.append(try_hid(NAME, text, where, entry))
    return found


def _chosen(entries: list[Entry], choice: DeviceChoice) -> Entry:
    """Return the interface of the pad that the user chose; raise DeviceError if there is none."""
    if not entries:
        raise DeviceError(NAME, "no DualSense was found", "connect one by cable")
    if serial := choice.text("serial"):
        named = [entry for entry in entries if entry["serial_number"] == serial]
        if not named:
            there = ", ".join(entry["serial_number"] or "one without" for entry in entries)
            raise DeviceError(NAME, f"there is none with the number {serial}", f"there is: {there}")
        entries = named
    number = _number_of(choice)
    if number > len(entries):
        raise DeviceError(NAME, f"there is no pad {number}", f"pads are 1 to {len(entries)}")
    return entries[number - 1]


def _first_report(link: PadLink, clock: Clock) -> Held:
    end = clock.now() + FIRST_REPORT
    try:
        while clock.now() < end:
            reported = link.poll()
            if reported is not None:
                link.send(OFF)
                return reported
            clock.sleep_until(clock.now() + 0.001)
    except DeviceError:
        link.close()
        raise
    link.close()
    raise DeviceError(
        NAME, "what has its USB id sends no reports of a DualSense", "press its PS button"
    )


def _side_of(choice: DeviceChoice) -> str:
    return choice.one_of("trigger", SIDES, "right")


def _place_of(choice: DeviceChoice) -> str:
    return choice.one_of("place", _PLACES, "front")


def _depth_of(choice: DeviceChoice) -> float:
    """Return the tip's motion over the trigger's stroke [m]; SettingError outside 2 to 200 mm."""
    return 1e-3 * choice.number("depth", 30.0, 2.0, 200.0, "mm")


def _full_of(choice: DeviceChoice) -> float:
    """Return the force for the largest resistance [N]; SettingError outside 0.5 to 10 N."""
    return choice.number("full", 3.0, 0.5, 10.0, "N")


def _number_of(choice: DeviceChoice) -> int:
    return math.floor(choice.number("number", 1, 1, _MAX_PADS))


def _info(choice: DeviceChoice) -> DeviceInfo:
    _side_of(choice)
    _place_of(choice)
    _number_of(choice)
    turn_of(choice)
    return pad_info(_depth_of(choice), _full_of(choice))


KIND = DeviceKind(
    NAME,
    "a Sony DualSense by cable, whose trigger presses and resists",
    (
        ("trigger", "that presses: right or left"),
        ("depth", "way of the tip over the whole way of the trigger, 2 to 200 mm"),
        ("full", "force that full resistance of the trigger stands for, 0.5 to 10 N"),
        ("number", "of a pad, where there are several, from 1"),
        ("serial", "number of a pad, where there are several, as `cohaptic devices` tells it"),
        ("place", "whence it presses: front (of the body) or top"),
        *(option for option in PLACING_OPTIONS if option[0] == "turn"),
    ),
    _info,
    open_dualsense,
    find_pads,
)
