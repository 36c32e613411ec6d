"""Serial ports as drivers of boards use them: opened for one program, and never waited for."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterable
from importlib import import_module
from typing import Any, Protocol

from cohaptic.errors import DeviceError

UNPLUGGED = "plug it in again, then start again"


class Port(Protocol):
    """An open serial port of pyserial that waits for nothing."""

    def read(self, size: int) -> bytes:
        """What has come, `size` bytes at most."""
        ...

    def write(self, data: bytes) -> object:
        """Send, as far as there is room."""
        ...

    def close(self) -> None:
        """Release the port."""
        ...


class NeverWaiting:
    """A port of pyserial on a system with file numbers, whose `write` tries for ever when full.

    Args:
        port: Open, without a time to wait; this object closes it.
        cut: Sent before what follows a message that was sent in part, so that its rest is not
            taken for a beginning; empty where the board finds the next message by itself.
    """

    def __init__(self, port: Any, cut: bytes = b"\n") -> None:
        self._port, self._mark = port, cut
        self._cut = False  # whether the last message was sent in part

    def read(self, size: int) -> bytes:
        """What has come, `size` bytes at most."""
        data: bytes = self._port.read(size)
        return data

    def write(self, data: bytes) -> int:
        """Send, as far as there is room; what was cut off before stays cut off."""
        if self._cut:
            data = self._mark + data
        try:
            sent = os.write(self._port.fileno(), data)
        except BlockingIOError:
            return 0  # the board takes nothing: it is silent, and will be gone
        self._cut = sent < len(data)
        return sent

    def close(self) -> None:
        """Release the port."""
        self._port.close()


def open_port(name: str, path: str, vendor: str, *, baud: int = 9600, cut: bytes = b"\n") -> Port:
    """The port at a path, without a time to wait.

    Args:
        name: Name of the device, for errors.
        path: Such as /dev/ttyACM0.
        vendor: USB id of the board's maker, in the rule that is offered where a right is missing.
        baud: Bits per second; boards that are USB devices themselves ignore it.
        cut: As `NeverWaiting` has it.

    Raises:
        DeviceError: There is none, or it may not be opened, or another program has it.
    """
    try:
        port = _serial(name).Serial(path, baud, timeout=0, write_timeout=0, exclusive=True)
    except OSError as error:
        raise DeviceError(name, *_why_not(path, vendor, error)) from error
    if sys.platform == "win32":
        return port  # type: ignore[no-any-return]
    # A bridge chip collects bytes for 16 ms before it sends them on, unless it is asked not to.
    with contextlib.suppress(Exception):
        port.set_low_latency_mode(True)
    return NeverWaiting(port, cut)


def attempt(name: str, action: Any) -> Any:
    """What an action on a port gives; raises DeviceError where the port is gone."""
    try:
        return action()
    except (OSError, TypeError) as error:  # pyserial's is an OSError; a closed port a TypeError
        raise DeviceError(name, f"it was unplugged ({error})", UNPLUGGED) from error


def list_ports(name: str) -> list[Any]:
    """Serial ports of this machine, as pyserial describes them; raises DeviceError without it."""
    _serial(name)
    return list(import_module("serial.tools.list_ports").comports())


def unknown_ports(known: Iterable[str]) -> list[str]:
    """Serial ports of USB at which no driver has found a board; raises DeviceError.

    Args:
        known: Where the drivers have found theirs.
    """
    places = set(known)
    ports = (port for port in list_ports("serial boards") if port.vid is not None)
    return [
        f"{port.vid:04x}:{port.pid:04x} {port.description} at {port.device}"
        for port in ports
        if port.device not in places
    ]


def _why_not(path: str, vendor: str, error: OSError) -> tuple[str, str]:
    """Problem and advice for a port that cannot be opened."""
    text = str(error).lower()
    if "no such file" in text or "could not configure" in text:
        what = "there is no port" if "no such file" in text else "no serial port is at"
        return f"{what} {path}", "see what `cohaptic devices` lists"
    if "permission" in text:
        rule = f'SUBSYSTEM=="tty", ATTRS{{idVendor}}=="{vendor}", TAG+="uaccess", '
        rule += 'ENV{ID_MM_DEVICE_IGNORE}="1"'
        advice = f"put the line {rule} into /etc/udev/rules.d/70-cohaptic.rules, plug it in again"
        return f"{path} may not be opened", advice
    if "lock" in text or "busy" in text:
        return f"{path} is used by another program", "quit that program"
    return f"{path} cannot be opened ({error})", "see what `cohaptic devices` lists"


def _serial(name: str) -> Any:
    try:
        return import_module("serial")
    except ImportError as error:
        advice = "run: pip install pyserial"
        raise DeviceError(name, "the Python package pyserial is missing", advice) from error
