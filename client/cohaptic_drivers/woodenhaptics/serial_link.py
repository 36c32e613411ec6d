"""Connection to the serial board: one answer line per command line; no call waits for the port.

The board only answers commands, and switches its motors off 100 ms after the last command.
"""

from __future__ import annotations

from typing import Any

from cohaptic.clock import Clock
from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.serial_ports import Port, attempt, list_ports, open_port
from cohaptic_drivers.woodenhaptics.arm import NAME
from cohaptic_drivers.woodenhaptics.reports import Reported, command_line, read_answer

_LONGEST = 4096  # bytes that may wait to be read; an answer has 60
_PATIENCE = 0.005  # s to wait for an answer; then the next command goes out without it
_MAX_BAD = 10  # lines in a row that are no answers, or report an error in the command: 10 ms
_VENDOR = "16c0"
_TEENSY = (0x16C0, 0x0483)
_CALLS = 0.1  # s between the first commands, until the board answers
_FIRST_ANSWER = 2.0  # s


class SerialLink:
    """Connection to a serial board.

    Args:
        port: Open port; this object closes it.
        clock: Clock that times the board's answers; it must go on while the loop hangs.
    """

    def __init__(self, port: Port, clock: Clock) -> None:
        self._port, self._clock = port, clock
        self._rest = b""
        self._bad = 0
        self._report: Reported | None = None
        self._sent: float | None = None  # time of the command that still has no answer
        self._given = ZERO  # currents of the last command [mA]
        self._closed = False

    def poll(self, now: float) -> Reported | None:
        """Return the newest answer since the last call; None without one.

        Raises:
            DeviceError: The port is gone, or the data from it are not answers of this board.
        """
        self._hear()
        reported, self._report = self._report, None
        return reported

    def send(self, milliamps: Vec3) -> None:
        """Send currents [mA] if the last command has its answer; send a change to zero at once.

        This call reads the answer itself, because the loop does not poll while it releases the
        force; the call therefore raises as `poll`.
        """
        if milliamps == ZERO != self._given:
            self._send(ZERO)
            return
        if self._sent is not None:
            self._hear()
        if self._sent is None or self._clock.now() - self._sent > _PATIENCE:
            self._send(milliamps)

    def release(self) -> None:
        """Send zero currents without waiting for an answer; may be called from another thread."""
        self._send(ZERO)

    def _send(self, milliamps: Vec3) -> None:
        self._given, self._sent = milliamps, self._clock.now()
        attempt(NAME, lambda: self._port.write(command_line(milliamps)))

    def _hear(self) -> None:
        """Read the answers that have arrived, and keep the newest."""
        for line in self._lines():
            reported = read_answer(line)
            if reported is None or reported.error:
                self._bad += 1
                problem = (
                    "is no answer of it" if reported is None else f"tells error {reported.error}"
                )
                if self._bad >= _MAX_BAD:
                    raise DeviceError(NAME, f"what comes from its board {problem}", "see its cable")
            else:
                self._bad = 0
            self._sent = None
            # The counts of an answer with an error are those of the answer before.
            self._report = reported if reported is not None and not reported.error else self._report

    def close(self) -> None:
        """Send zero currents, then release the port; may be called twice."""
        if not self._closed:
            self._closed = True
            try:
                for _ in range(2):
                    self._port.write(command_line(ZERO))
            except OSError:
                pass  # the port is gone, and the board switches its motors off by itself
            self._port.close()

    def _lines(self) -> list[bytes]:
        data: bytes = self._rest + attempt(NAME, lambda: self._port.read(_LONGEST))
        *lines, self._rest = data.split(b"\n")
        if len(self._rest) > _LONGEST:
            raise DeviceError(NAME, "what comes from its board has no lines", "see its cable")
        return lines


def find_ports() -> list[Any]:
    """Return the serial ports that may have such a board, by their USB ids and names."""
    return [each for each in list_ports(NAME) if may_be_board(each)]


def may_be_board(port: Any) -> bool:
    """Return whether a port belongs to a Teensy and not to a Haply Inverse3 (same USB id)."""
    names = f"{port.product} {port.description} {port.manufacturer}".lower()
    return (port.vid, port.pid) == _TEENSY and "haply" not in names


def open_serial(path: str, clock: Clock) -> tuple[SerialLink, Reported]:
    """Open the board at a port and wait; return its connection and its first answer.

    Raises:
        DeviceError: There is no port, this user may not open it, or another device answers.
    """
    link = SerialLink(open_port(NAME, path, _VENDOR), clock)
    try:
        first = _first_answer(link, clock)
    except DeviceError as error:  # the bytes from the port are no answers
        link.close()
        raise _another(path) from error
    if first is None:
        link.close()
        raise _another(path)
    return link, first


def _first_answer(link: SerialLink, clock: Clock) -> Reported | None:
    """Repeat a command of zero current, as the port may lose the first; None without an answer."""
    end = clock.now() + _FIRST_ANSWER
    while (now := clock.now()) < end:
        link.send(ZERO)
        called = now
        while clock.now() < called + _CALLS:
            reported = link.poll(clock.now())
            if reported is not None:
                return reported
            clock.sleep_until(clock.now() + 0.001)
    return None


def _another(path: str) -> DeviceError:
    return DeviceError(
        NAME,
        f"what is at {path} does not answer as its board does",
        "see that its firmware is loaded; a Haply Inverse3 has the same USB id: --device haply",
    )
