"""Marks for the recording of a session."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

from pydantic import ValidationError

from cohaptic.errors import SettingError
from cohaptic.protocol.messages import MAX_MARK_AGE, Mark
from cohaptic_client.network.server_clock import ClockReading

PACE = 0.05  # s between two marks; a server takes 60 messages a second of a connection
MOST_WAITING = 64  # marks; three seconds of them
_AT_ONCE = 1e-3  # s between two marks of one moment
Value = str | float | bool | None
NOT_RECORDED = "set while the server records the session (cohaptic serve --record)"


def mark_of(text: str, fields: Mapping[str, Value], ago: float = 0.0) -> Mark:
    """Return a mark.

    Args:
        text: What it says, up to 200 characters.
        fields: Up to 16 further values.
        ago: Time since the marked moment [s].

    Raises:
        SettingError: A value is out of its limits.
    """
    try:
        return Mark(text=text, fields=dict(fields), ago=ago)
    except ValidationError as error:
        problem = error.errors()[0]
        where = ".".join(str(part) for part in problem["loc"][:2])
        value = repr(problem["input"])[:60]
        raise SettingError(f"{where} of a mark", value, str(problem["msg"])) from error


class Stamps:
    """Gives the marks of one sender their times on the server's clock, in their order."""

    def __init__(self) -> None:
        self._last = (-math.inf, -math.inf)  # of the last mark: on both clocks [s]

    def on(self, mark: Mark, at: float, now: float, clock: ClockReading | None) -> Mark:
        """Return a mark with its time for the server.

        Args:
            mark: The mark.
            at: The marked moment, on the sender's clock [s].
            now: Time at which it leaves [s].
            clock: The server's clock; None while it is not known.
        """
        times = {"ago": min(MAX_MARK_AGE, max(0.0, now - at))}
        if clock is not None:
            there = at + clock.to_server
            # Neither a better estimate nor the time to pass a mark on must turn two around.
            if at >= self._last[0] - _AT_ONCE:
                there = max(there, self._last[1])
            self._last = at, there
            times |= {"at": there, "error": min(clock.error, MAX_MARK_AGE)}
        return mark.model_copy(update=times)


class MarksOut:
    """Marks that wait to leave, one after the other at a pace; any thread may put one."""

    def __init__(self) -> None:
        self._waiting = deque[tuple[float, Mark]]()  # each with its time [s]
        self._stamps = Stamps()
        self._next = -math.inf  # time from which on the next may leave [s]

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, now: float, text: str, fields: Mapping[str, Value]) -> None:
        """Add a mark of this moment.

        Args:
            now: Time [s].
            text: What it says, up to 200 characters.
            fields: Up to 16 further values.

        Raises:
            SettingError: A value is out of its limits, or too many marks wait.
        """
        if len(self._waiting) >= MOST_WAITING:
            limit = f"at most {MOST_WAITING} that wait, of which {1.0 / PACE:g} a second leave"
            raise SettingError("marks", "more", limit)
        self._waiting.append((now, mark_of(text, fields)))

    def due(self, now: float, clock: ClockReading | None) -> Mark | None:
        """Remove and return the oldest mark, with its time; None if none may leave now [s].

        Args:
            now: Time [s].
            clock: The server's clock; None while it is not known.
        """
        if not self._waiting or now < self._next:
            return None
        self._next = now + PACE
        at, mark = self._waiting.popleft()
        return self._stamps.on(mark, at, now, clock)
