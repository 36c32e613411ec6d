"""The serial board: one line for each line, on a port that is never waited for.

The board answers a command and nothing else, and switches its motors off 100 ms after the last.
"""

from __future__ import annotations

from typing import Any

from cohaptic.clock import Clock
from cohaptic.errors import DeviceError
from cohaptic.vec import ZERO, Vec3
from cohaptic_client.devices.serial_ports import Port, attempt, list_ports, open_port
from cohaptic_drivers.woodenhaptics.arm import NAME
from cohaptic_drivers.woodenhaptics.reports import Told, command_line, read_answer

_LONGEST = 4096  # bytes that wait; an answer has 60
_PATIENCE = 0.005  # s for an answer; then the next command goes out all the same
_MOST_BAD = 10  # lines in a row that are none, or tell that ours was none: 10 ms of them
_VENDOR = "16c0"
_TEENSY = (0x16C0, 0x0483)
_CALLS = 0.1  # s between the first commands, until the board answers
_FIRST_ANSWER = 2.0  # s


class SerialLink:
    """The way to a serial board.

    Args:
        port: Open; this object closes it.
        clock: By which its answers are waited for: one that goes on while the loop hangs.
    """

    def __init__(self, port: Port, clock: Clock) -> None:
        self._port, self._clock = port, clock
        self._rest = b""
        self._bad = 0
        self._told: Told | None = None
        self._sent: float | None = None  # when the command went out that waits for its answer
        self._given = ZERO  # by the last command
        self._closed = False

    def poll(self, now: float) -> Told | None:
        """The newest answer.

        Raises:
            DeviceError: The port is gone, or what comes from it is not this board's.
        """
        self._hear()
        told, self._told = self._told, None
        return told

    def give(self, milliamps: Vec3) -> None:
        """Send a command, if the board has answered the one before; no currents at once.

        Raises as `poll`: it looks for the answer, as nobody polls while a hand is let go.
        """
        if milliamps == ZERO != self._given:
            self._send(ZERO)
            return
        if self._sent is not None:
            self._hear()
        if self._sent is None or self._clock.now() - self._sent > _PATIENCE:
            self._send(milliamps)

    def release(self) -> None:
        """No currents, whatever the board has answered; for another thread."""
        self._send(ZERO)

    def _send(self, milliamps: Vec3) -> None:
        self._given, self._sent = milliamps, self._clock.now()
        attempt(NAME, lambda: self._port.write(command_line(milliamps)))

    def _hear(self) -> None:
        """Keep the newest answer that has come."""
        for line in self._lines():
            told = read_answer(line)
            if told is None or told.error:
                self._bad += 1
                problem = "is no answer of it" if told is None else f"tells error {told.error}"
                if self._bad >= _MOST_BAD:
                    raise DeviceError(NAME, f"what comes from its board {problem}", "see its cable")
            else:
                self._bad = 0
            self._sent = None
            # With an error the counts are those of before.
            self._told = told if told is not None and not told.error else self._told

    def close(self) -> None:
        """No currents, then release the port; may be called twice."""
        if not self._closed:
            self._closed = True
            try:
                for _ in range(2):
                    self._port.write(command_line(ZERO))
            except OSError:
                pass  # it is gone, and its board switches off by itself
            self._port.close()

    def _lines(self) -> list[bytes]:
        data: bytes = self._rest + attempt(NAME, lambda: self._port.read(_LONGEST))
        *lines, self._rest = data.split(b"\n")
        if len(self._rest) > _LONGEST:
            raise DeviceError(NAME, "what comes from its board has no lines", "see its cable")
        return lines


def find_ports() -> list[Any]:
    """Serial ports on which such a board may be, by their USB ids and names."""
    return [each for each in list_ports(NAME) if may_be_board(each)]


def may_be_board(port: Any) -> bool:
    """Whether a port is a Teensy's, and not that of a Haply Inverse3, which is one, too."""
    names = f"{port.product} {port.description} {port.manufacturer}".lower()
    return (port.vid, port.pid) == _TEENSY and "haply" not in names


def open_serial(path: str, clock: Clock) -> tuple[SerialLink, Told]:
    """The board at a port, once it has answered.

    Raises:
        DeviceError: There is none, it may not be opened, or something else answers.
    """
    link = SerialLink(open_port(NAME, path, _VENDOR), clock)
    try:
        first = _first_answer(link, clock)
    except DeviceError as error:  # bytes that are no answers
        link.close()
        raise _another(path) from error
    if first is None:
        link.close()
        raise _another(path)
    return link, first


def _first_answer(link: SerialLink, clock: Clock) -> Told | None:
    """Call until the board answers, as the port may swallow the first call; None if it does not."""
    end = clock.now() + _FIRST_ANSWER
    while (now := clock.now()) < end:
        link.give(ZERO)
        called = now
        while clock.now() < called + _CALLS:
            told = link.poll(clock.now())
            if told is not None:
                return told
            clock.sleep_until(clock.now() + 0.001)
    return None


def _another(path: str) -> DeviceError:
    return DeviceError(
        NAME,
        f"what is at {path} does not answer as its board does",
        "see that its firmware is loaded; a Haply Inverse3 has the same USB id: --device haply",
    )
