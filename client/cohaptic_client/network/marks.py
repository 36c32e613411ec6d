"""Marks for the recording of a session."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

from pydantic import ValidationError

from cohaptic.errors import SettingError
from cohaptic.protocol.messages import Mark

Marks = deque[tuple[float, Mark]]  # that wait, each with its time on the client's clock [s]
PACE = 0.05  # s between two marks; a server takes 60 messages a second of a connection
MOST_WAITING = 64  # marks; three seconds of them
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
