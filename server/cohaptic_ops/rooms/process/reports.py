"""What a room's process and its supervisor tell each other, as lines of JSON. No I/O.

State (a report, an allowance) replaces its like; all else is an event.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from cohaptic_ops.monitoring.json_lines import JsonLines
from cohaptic_ops.monitoring.metrics import RoomMetrics

LONGEST = 64 * 1024  # characters of a line


class _Line(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Ready(_Line):
    """The room can be touched."""

    kind: Literal["ready"] = "ready"


class Failed(_Line):
    """The room cannot be opened; its process ends.

    Args:
        why: A sentence.
    """

    kind: Literal["failed"] = "failed"
    why: str


class Left(_Line):
    """Connections that were handed over have ended.

    Args:
        numbers: As they were handed over.
    """

    kind: Literal["left"] = "left"
    numbers: list[int]


class Report(_Line):
    """State of a room, a few times a second.

    Args:
        users, watchers: Who is there.
        held_users, held_watchers: Seats that it holds.
        users_serial, watchers_serial: Serial numbers of the newest `Allow` that it has read; 0
            before the first.
        ticks, missed: Since its start.
    """

    kind: Literal["report"] = "report"
    users: int = Field(ge=0)
    watchers: int = Field(ge=0)
    held_users: int = Field(ge=0)
    held_watchers: int = Field(ge=0)
    users_serial: int = Field(ge=0)
    watchers_serial: int = Field(ge=0)
    ticks: int = Field(ge=0)
    missed: int = Field(ge=0)


class Measured(_Line):
    """What a room tells those who look after the server, once a second.

    Args:
        metrics: Metrics of the room.
    """

    kind: Literal["measured"] = "measured"
    metrics: RoomMetrics


class Allow(_Line):
    """Seats that a room may hold.

    Args:
        users, watchers: How many.
        users_serial, watchers_serial: As in `seats.Seats`.
    """

    kind: Literal["allow"] = "allow"
    users: int = Field(ge=0)
    watchers: int = Field(ge=0)
    users_serial: int = Field(ge=0)
    watchers_serial: int = Field(ge=0)


class Stop(_Line):
    """The room has to tell everybody and end."""

    kind: Literal["stop"] = "stop"


class ReadAgain(_Line):
    """The room has to read its files again: keys."""

    kind: Literal["read_again"] = "read_again"


FromRoom = Ready | Failed | Left | Report | Measured
ToRoom = Allow | Stop | ReadAgain
Line = FromRoom | ToRoom
_KINDS: TypeAdapter[Line] = TypeAdapter(Annotated[Line, Field(discriminator="kind")])
_LINES = JsonLines(_KINDS)
encode, decode = _LINES.encode, _LINES.decode


# Before a room has been told how many it may seat: none.
NO_SEATS = Allow(users=0, watchers=0, users_serial=0, watchers_serial=0)
