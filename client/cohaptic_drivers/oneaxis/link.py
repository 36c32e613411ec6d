"""The way to a one-axis board: a force goes out, a report comes back, and nobody waits.

The board answers a command and nothing else, and switches its motor off by itself when none comes.
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
_LONGEST = 4096  # bytes that wait; a report has 16
_PATIENCE = 0.005  # s for a report; then the next command goes out all the same
_MOST_SKIPPED = 160  # bytes in a row that are no frame: ten reports of them
_CALLS = 0.1  # s between the first calls, until the board answers
FIRST_ANSWER = 4.0  # s; opening the port starts an Arduino anew, and its boot loader waits for 2
_LONGEST_WATCHDOG = 0.1  # s; a board that holds a force for longer is none of ours
_VENDOR = "1a86"  # in the rule that is offered: most boards have this bridge
# Makers of boards and of bridges on boards: FTDI, WCH, Silicon Labs, Arduino twice, Adafruit.
_VENDORS = frozenset({0x0403, 0x1A86, 0x10C4, 0x2341, 0x2A03, 0x239A})


class BoardLink:
    """The way to a one-axis board.

    Args:
        port: Open; this object closes it.
        clock: By which its reports are waited for: one that goes on while the loop hangs.
    """

    def __init__(self, port: Port, clock: Clock) -> None:
        self._port, self._clock = port, clock
        self._reader = Reader()
        self._told: Report | None = None
        self._described: Description | None = None
        self._sent: float | None = None  # when the command went out that waits for its report
        self._given = 0.0  # by the last command [A]
        self._sequence = 0
        self._closed = False

    def poll(self) -> Report | None:
        """The newest report since the last call.

        Raises:
            DeviceError: The port is gone, or what comes from it is not this protocol.
        """
        self._hear()
        told, self._told = self._told, None
        return told

    def description(self) -> Description | None:
        """What the board said of itself, once it has; raises as `poll`."""
        self._hear()
        return self._described

    def ask(self) -> None:
        """Ask the board who it is, which gives no force; raises as `poll`."""
        self._write(identify(self._next()))

    def give(self, amperes: float) -> None:
        """Send a current, if the board has answered the one before; none at once.

        Raises as `poll`: it looks for the report, as nobody polls while a hand is let go.
        """
        if amperes == 0.0 != self._given:
            self._send(0.0)
            return
        if self._sent is not None:
            self._hear()
        if self._sent is None or self._clock.now() - self._sent > _PATIENCE:
            self._send(amperes)

    def release(self) -> None:
        """No current, whatever the board has answered; for another thread."""
        self._send(0.0)

    def close(self) -> None:
        """No current, then release the port; may be called twice."""
        if not self._closed:
            self._closed = True
            try:
                for _ in range(2):
                    self._port.write(command(self._next(), 0.0))
            except OSError:
                pass  # it is gone, and its board switches off by itself
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
        for told in self._reader.take(data):
            if isinstance(told, Description):
                self._described = told
            else:
                self._told, self._sent = told, None
        if self._reader.skipped > _MOST_SKIPPED:
            raise DeviceError(
                NAME, "what comes from its board is none of its reports", "see its cable"
            )


def open_board(path: str, clock: Clock) -> tuple[BoardLink, Description, Report]:
    """The board at a port, once it has said who it is and where it is.

    Raises:
        DeviceError: There is none, it may not be opened, or something else answers.
    """
    link = BoardLink(open_port(NAME, path, _VENDOR, baud=BAUD, cut=b""), clock)
    try:
        described = _answer(link.ask, link.description, clock)
        if described is None:
            raise _another(path)
        _check(described, path)
        first = _answer(lambda: link.give(0.0), link.poll, clock)
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
    """Serial ports on which such a board may be, by the makers of their USB chips."""
    return [each for each in list_ports(NAME) if each.vid in _VENDORS]


def _answer(call: Callable[[], None], answer: Callable[[], Any], clock: Clock) -> Any:
    """Call until there is an answer, as a board that starts swallows the first calls."""
    end = clock.now() + FIRST_ANSWER
    while (called := clock.now()) < end:
        call()
        while clock.now() < called + _CALLS:
            told = answer()
            if told is not None:
                return told
            clock.sleep_until(clock.now() + 0.001)
    return None


def _check(described: Description, path: str) -> None:
    """Refuse firmware that this driver does not know, or that would hold a force for too long."""
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
