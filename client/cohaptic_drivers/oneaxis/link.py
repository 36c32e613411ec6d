"""Connection to a one-axis board: a command goes out and a report comes back; no call waits for it.

The board only answers commands, and switches its motor off by itself when no command comes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cohaptic.clock import Clock
from cohaptic.errors import DeviceError
from cohaptic_client.devices.serial_ports import Port, attempt, list_ports, open_port
from cohaptic_drivers.oneaxis.frames import (
    NAME,
    VERSION,
    Description,
    Reader,
    Report,
    command,
    identify,
)

BAUD = 500_000
_LONGEST = 4096  # bytes that may wait to be read; a report has 16
_PATIENCE = 0.005  # s to wait for a report; then the next command goes out without it
_MAX_SKIPPED = 160  # bytes in a row that are no frame: the length of ten reports
_CALLS = 0.1  # s between the first commands, until the board answers
FIRST_ANSWER = 4.0  # s; opening the port starts an Arduino anew, and its boot loader waits for 2 s
_LONGEST_WATCHDOG = 0.1  # s; a board that holds a force for longer is refused
_VENDOR = "1a86"  # for the udev rule that an error advises: most boards have a bridge of this maker
# Makers of boards and of bridges on boards: FTDI, WCH, Silicon Labs, Arduino twice, Adafruit.
_VENDORS = frozenset({0x0403, 0x1A86, 0x10C4, 0x2341, 0x2A03, 0x239A})


class BoardLink:
    """Connection to a one-axis board.

    Args:
        port: Open port; this object closes it.
        clock: Clock that times the board's reports; it must go on while the loop hangs.
    """

    def __init__(self, port: Port, clock: Clock) -> None:
        self._port, self._clock = port, clock
        self._reader = Reader()
        self._report: Report | None = None
        self._described: Description | None = None
        self._sent: float | None = None  # time of the command that still has no report
        self._given = 0.0  # current of the last command [A]
        self._sequence = 0
        self._closed = False

    def poll(self) -> Report | None:
        """Return the newest report since the last call; None without one.

        Raises:
            DeviceError: The port is gone, or the data from it are not of this protocol.
        """
        self._hear()
        reported, self._report = self._report, None
        return reported

    def description(self) -> Description | None:
        """Return the description that the board has sent, or None; raise as `poll`."""
        self._hear()
        return self._described

    def ask(self) -> None:
        """Request the board's description; the request gives no force. Raises as `poll`."""
        self._write(identify(self._next()))

    def send(self, amperes: float) -> None:
        """Send a current [A] if the last command has its report; send a change to zero at once.

        This call reads the report itself, because the loop does not poll while it releases the
        force; the call therefore raises as `poll`.
        """
        if amperes == 0.0 != self._given:
            self._send(0.0)
            return
        if self._sent is not None:
            self._hear()
        if self._sent is None or self._clock.now() - self._sent > _PATIENCE:
            self._send(amperes)

    def release(self) -> None:
        """Send zero current without waiting for a report; may be called from another thread."""
        self._send(0.0)

    def close(self) -> None:
        """Send zero current, then release the port; may be called twice."""
        if not self._closed:
            self._closed = True
            try:
                for _ in range(2):
                    self._port.write(command(self._next(), 0.0))
            except OSError:
                pass  # the port is gone, and the board switches its motor off by itself
            self._port.close()

    def _send(self, amperes: float) -> None:
        self._given, self._sent = amperes, self._clock.now()
        self._write(command(self._next(), amperes))

    def _write(self, data: bytes) -> None:
        attempt(NAME, lambda: self._port.write(data))

    def _next(self) -> int:
        self._sequence = (self._sequence + 1) & 0xFF
        return self._sequence

    def _hear(self) -> None:
        data: bytes = attempt(NAME, lambda: self._port.read(_LONGEST))
        for reported in self._reader.take(data):
            if isinstance(reported, Description):
                self._described = reported
            else:
                self._report, self._sent = reported, None
        if self._reader.skipped > _MAX_SKIPPED:
            raise DeviceError(
                NAME, "what comes from its board is none of its reports", "see its cable"
            )


def open_board(path: str, clock: Clock) -> tuple[BoardLink, Description, Report]:
    """Open the board at a port; return the connection, the description and the first report.

    Raises:
        DeviceError: There is no port, this user may not open it, or another device answers.
    """
    link = BoardLink(open_port(NAME, path, _VENDOR, baud=BAUD, cut=b""), clock)
    try:
        described = _answer(link.ask, link.description, clock)
        if described is None:
            raise _another(path)
        _check(described, path)
        first = _answer(lambda: link.send(0.0), link.poll, clock)
    except DeviceError as error:
        link.close()
        raise (_another(path) if "reports" in error.problem else error) from error
    if first is None:
        link.close()
        raise DeviceError(
            NAME, f"the board at {path} says who it is, and then nothing", "see its cable"
        )
    return link, described, first


def find_ports() -> list[Any]:
    """Return the serial ports that may have such a board, by the makers of their USB chips."""
    return [each for each in list_ports(NAME) if each.vid in _VENDORS]


def _answer(call: Callable[[], None], answer: Callable[[], Any], clock: Clock) -> Any:
    """Repeat a call until an answer comes, as a starting board loses calls; None without one."""
    end = clock.now() + FIRST_ANSWER
    while (called := clock.now()) < end:
        call()
        while clock.now() < called + _CALLS:
            reported = answer()
            if reported is not None:
                return reported
            clock.sleep_until(clock.now() + 0.001)
    return None


def _check(described: Description, path: str) -> None:
    """Raise DeviceError for firmware that is unknown, or that would hold a force for too long."""
    load = "load the one of examples/one_axis_board"
    if described.version != VERSION:
        problem = f"the firmware of the board at {path} speaks version {described.version}"
        raise DeviceError(NAME, f"{problem}, this program {VERSION}", load)
    if not 0.0 < described.watchdog <= _LONGEST_WATCHDOG:
        held = f"holds a force for {1e3 * described.watchdog:.0f} ms of silence"
        raise DeviceError(NAME, f"the board at {path} {held}", f"{load}, which allows 100 ms")


def _another(path: str) -> DeviceError:
    return DeviceError(
        NAME,
        f"what is at {path} does not answer as such a board does",
        "see that it has power, and the firmware of examples/one_axis_board",
    )
