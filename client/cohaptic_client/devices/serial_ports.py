"""Serial ports for drivers of boards: opened exclusively, read and written without waiting."""

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
    """An open serial port whose methods never wait."""

    def read(self, size: int) -> bytes:
        """Return the bytes that have arrived, `size` at most."""
        ...

    def write(self, data: bytes) -> object:
        """Send as many of the bytes as the port has room for."""
        ...

    def close(self) -> None:
        """Release the port."""
        ...


class NeverWaiting:
    """A serial port whose `write` never waits; pyserial's own tries for ever if the port is full.

    The port needs a file descriptor, which ports on Windows lack.

    Args:
        port: Open port of pyserial with time-out 0; this object closes it.
        cut: Bytes that are sent before the next message when a message was sent only in part, so
            that the board separates the two; empty if the board finds the next message by itself.
    """

    def __init__(self, port: Any, cut: bytes = b"\n") -> None:
        self._port, self._mark = port, cut
        self._cut = False  # whether the last message was sent in part

    def read(self, size: int) -> bytes:
        """Return the bytes that have arrived, `size` at most."""
        data: bytes = self._port.read(size)
        return data

    def write(self, data: bytes) -> int:
        """Send as many bytes as the port has room for; the rest of the message is dropped."""
        if self._cut:
            data = self._mark + data
        try:
            sent = os.write(self._port.fileno(), data)
        except BlockingIOError:
            return 0  # the board takes no bytes: it is silent, and will soon count as gone
        self._cut = sent < len(data)
        return sent

    def close(self) -> None:
        """Release the port."""
        self._port.close()


def open_port(name: str, path: str, vendor: str, *, baud: int = 9600, cut: bytes = b"\n") -> Port:
    """Open the serial port at a path, exclusively and with time-out 0.

    Args:
        name: Name of the device, for errors.
        path: Path such as /dev/ttyACM0.
        vendor: USB id of the board's maker, for the udev rule in the advice on missing rights.
        baud: Bits per second; boards that are USB devices themselves ignore it.
        cut: Bytes that separate a cut message from the next, as in `NeverWaiting`.

    Raises:
        DeviceError: There is no port, this user may not open it, or another program uses it.
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
    """Call an action on a port and return its result; raise DeviceError if the port is gone."""
    try:
        return action()
    except (OSError, TypeError) as error:  # pyserial raises OSError; a closed port raises TypeError
        raise DeviceError(name, f"it was unplugged ({error})", UNPLUGGED) from error


def list_ports(name: str) -> list[Any]:
    """List the serial ports as pyserial describes them; raise DeviceError without pyserial."""
    _serial(name)
    return list(import_module("serial.tools.list_ports").comports())


def unknown_ports(known: Iterable[str]) -> list[str]:
    """List USB serial ports at which no driver found a board; raise DeviceError without pyserial.

    Args:
        known: Paths at which drivers have found boards.
    """
    places = set(known)
    ports = (port for port in list_ports("serial boards") if port.vid is not None)
    return [
        f"{port.vid:04x}:{port.pid:04x} {port.description} at {port.device}"
        for port in ports
        if port.device not in places
    ]


def _why_not(path: str, vendor: str, error: OSError) -> tuple[str, str]:
    """Return the problem and the advice for an error on opening a port."""
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
