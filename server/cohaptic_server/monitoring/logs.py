"""The log of a server: lines for people, or one JSON object a line for machines."""

from __future__ import annotations

import json
import logging
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import Enum
from typing import Any


class LogFormat(Enum):
    """As the command line names them."""

    TEXT = "text"
    JSON = "json"


@dataclass(frozen=True, slots=True)
class LogStyle:
    """How a server writes its log; passes from its process to those of its rooms.

    Args:
        level: Least level, of `logging`.
        format: Of a line.
    """

    level: int = logging.INFO
    format: LogFormat = LogFormat.TEXT


PLAIN = LogStyle()


class JsonLines(logging.Formatter):
    """A record as one line of JSON in ASCII: what a stranger wrote is escaped, whatever it is.

    Args:
        room: Of the process; None for that of a whole server.
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


def set_up_log(style: LogStyle, room: str | None = None) -> None:
    """Write the log of this process to standard error.

    Args:
        style: Of the lines.
        room: Of the process; None for that of a whole server.
    """
    handler = logging.StreamHandler(sys.stderr)
    if style.format is LogFormat.JSON:
        handler.setFormatter(JsonLines(room))
    else:
        whose = "" if room is None else f" [{room}]"
        handler.setFormatter(logging.Formatter(f"%(asctime)s{whose} %(message)s", "%H:%M:%S"))
    logging.basicConfig(level=style.level, handlers=[handler], force=True)
    # Our own lines report connections.
    logging.getLogger("websockets").setLevel(logging.CRITICAL)
