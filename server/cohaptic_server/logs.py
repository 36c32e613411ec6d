"""Writes the log of a server: lines for people, or one JSON object per line for machines.

A thread writes the log, so that the tick never waits for a terminal or a pipe.
"""

from __future__ import annotations

import json
import logging
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import Enum
from typing import Any

from cohaptic.errors import one_line
from cohaptic.runtime.aside import Aside, aside


class LogFormat(Enum):
    """Formats of the log, with their names on the command line."""

    TEXT = "text"
    JSON = "json"


@dataclass(frozen=True, slots=True)
class LogStyle:
    """Level and format of a server's log; the server passes them to the processes of its rooms.

    Args:
        level: Lowest level that is written, as in `logging`.
    """

    level: int = logging.INFO
    format: LogFormat = LogFormat.TEXT


PLAIN = LogStyle()
_LONGEST = 2**16  # characters of a line; a command with a painted rule has 17,000


class JsonLines(logging.Formatter):
    """Log formatter: one line of JSON in ASCII per record, so that text from clients is escaped.

    Args:
        room: Name of the room that this process serves, written with every record that names no
            room itself; None for the process of a whole server.
    """

    def __init__(self, room: str | None = None) -> None:
        super().__init__()
        self._room = room

    def format(self, record: logging.LogRecord) -> str:
        """Return the JSON line of a record, without the newline."""
        when = datetime.fromtimestamp(record.created, UTC)
        line: dict[str, Any] = {
            "time": when.isoformat(timespec="milliseconds").replace("+00:00", "Z"),
            "level": record.levelname.lower(),
            "event": getattr(record, "event", "") or "message",
            # A name of a file may hold bytes that are no text, which strict readers refuse.
            "message": record.getMessage().encode("utf-8", "replace").decode(),
        }
        for key in ("room", "user", "source", "field", "code"):
            value = getattr(record, key, "") or (self._room if key == "room" else None)
            if value:
                line[key] = value
        if record.exc_info:
            line["traceback"] = self.formatException(record.exc_info)
        return json.dumps(line)


class TextLines(logging.Formatter):
    """Log formatter: one printable line per record, whatever the names of people and files hold."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - the name of logging's
        """Return the line of a record, without a traceback."""
        return one_line(super().formatMessage(record), _LONGEST)


class Beside(logging.StreamHandler[Any]):
    """Log handler that writes to standard error without waiting; only `close` waits a moment."""

    def __init__(self, formatter: logging.Formatter) -> None:
        super().__init__(aside(sys.stderr, tell=self._left_out))
        self.setFormatter(formatter)

    def close(self) -> None:
        """Wait up to a second until the last lines are written, and close the handler."""
        if isinstance(self.stream, Aside):
            self.stream.drain()
        super().close()

    def _left_out(self, lines: int) -> str:
        words = "%d lines were left out here: nobody read them in time"
        values = {
            "msg": words,
            "args": (lines,),
            "levelno": logging.WARNING,
            "levelname": "WARNING",
        }
        reported = {"event": "lines_unread", "name": "cohaptic.server"}
        return self.format(logging.makeLogRecord(values | reported)) + self.terminator


def set_up_log(style: LogStyle, room: str | None = None) -> None:
    """Set up logging: this process writes its log to standard error.

    Args:
        room: Name of the room that this process serves; None for the process of a whole server.
    """
    whose = "" if room is None else f" [{room}]"
    formatter = TextLines(f"%(asctime)s{whose} %(message)s", "%H:%M:%S")
    handler = Beside(JsonLines(room) if style.format is LogFormat.JSON else formatter)
    logging.basicConfig(level=style.level, handlers=[handler], force=True)
    # The websockets library logs nothing, since the server's own lines report connections.
    logging.getLogger("websockets").setLevel(logging.CRITICAL)
