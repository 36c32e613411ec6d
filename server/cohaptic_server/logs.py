"""The log of a server: lines for people, or one JSON object a line for machines.

It is written beside the tick, which waits for no terminal and no pipe.
"""

from __future__ import annotations

import json
import logging
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import Enum
from typing import Any

from cohaptic.runtime.aside import Aside, aside


class LogFormat(Enum):
    """As the command line names them."""

    TEXT = "text"
    JSON = "json"


@dataclass(frozen=True, slots=True)
class LogStyle:
    """How a server writes its log; passes from its process to those of its rooms.

    Args:
        level: Least level, of `logging`.
        format: Format of a line.
    """

    level: int = logging.INFO
    format: LogFormat = LogFormat.TEXT


PLAIN = LogStyle()


class JsonLines(logging.Formatter):
    """A record as one line of JSON in ASCII: what a stranger wrote is escaped, whatever it is.

    Args:
        room: Room of the process; None for that of a whole server.
    """

    def __init__(self, room: str | None = None) -> None:
        super().__init__()
        self._room = room

    def format(self, record: logging.LogRecord) -> str:
        """The line, without its end."""
        when = datetime.fromtimestamp(record.created, UTC)
        line: dict[str, Any] = {
            "time": when.isoformat(timespec="milliseconds").replace("+00:00", "Z"),
            "level": record.levelname.lower(),
            "event": getattr(record, "event", "") or "message",
            "message": record.getMessage(),
        }
        for key in ("room", "user", "source"):
            value = getattr(record, key, "") or (self._room if key == "room" else None)
            if value:
                line[key] = value
        if record.exc_info:
            line["traceback"] = self.formatException(record.exc_info)
        return json.dumps(line)


class Beside(logging.StreamHandler[Any]):
    """Writes to standard error without waiting, but at the end, for a moment.

    Args:
        formatter: Formatter of the lines.
    """

    def __init__(self, formatter: logging.Formatter) -> None:
        super().__init__(aside(sys.stderr, tell=self._left_out))
        self.setFormatter(formatter)

    def close(self) -> None:
        """Let the last lines leave."""
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
        told = {"event": "lines_unread", "name": "cohaptic.server"}
        return self.format(logging.makeLogRecord(values | told)) + self.terminator


def set_up_log(style: LogStyle, room: str | None = None) -> None:
    """Write the log of this process to standard error.

    Args:
        style: Style of the lines.
        room: Room of the process; None for that of a whole server.
    """
    whose = "" if room is None else f" [{room}]"
    formatter = logging.Formatter(f"%(asctime)s{whose} %(message)s", "%H:%M:%S")
    handler = Beside(JsonLines(room) if style.format is LogFormat.JSON else formatter)
    logging.basicConfig(level=style.level, handlers=[handler], force=True)
    # Our own lines report connections.
    logging.getLogger("websockets").setLevel(logging.CRITICAL)
