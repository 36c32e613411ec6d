"""Messages between a room's process and its rooms server, as lines of JSON. No I/O.

A message with state (`Report`, `Measured`, `Allow`, `Until`) replaces the previous message of its
kind; the other kinds are events.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from cohaptic_ops.monitoring.json_lines import JsonLines
from cohaptic_ops.monitoring.metrics import RoomMetrics

LONGEST = 64 * 1024  # bytes of a line


class _Line(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Ready(_Line):
    """Message from a room: the room is open, and users can touch its body."""

    kind: Literal["ready"] = "ready"


class Failed(_Line):
    """Message from a room: it cannot be opened or has failed, and its process ends.

    Args:
        why: Reason, as a sentence.
    """

    kind: Literal["failed"] = "failed"
    why: str


class Left(_Line):
    """Message from a room: connections that were handed over have ended.

    Args:
        numbers: Numbers with which the connections were handed over.
    """

    kind: Literal["left"] = "left"
    numbers: list[int]


class Report(_Line):
    """Message from a room with its state, sent two to four times a second.

    Args:
        users, watchers: Numbers of users and watchers who are in the room.
        held_users, held_watchers: Numbers of seats that are assigned to the room for users and
            watchers.
        users_serial, watchers_serial: Serial numbers of the newest `Allow` that the room has read;
            0 before the first.
        ticks, missed: Numbers of due and of missed ticks since the start of the room.
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
    """Message from a room with its metrics for the admin port, sent once a second."""

    kind: Literal["measured"] = "measured"
    metrics: RoomMetrics


class Allow(_Line):
    """Message to a room: the numbers of seats that it may have.

    Args:
        users, watchers: Numbers of seats for users and for watchers.
        users_serial, watchers_serial: Serial numbers, as in `rooms_server.Seats`.
    """

    kind: Literal["allow"] = "allow"
    users: int = Field(ge=0)
    watchers: int = Field(ge=0)
    users_serial: int = Field(ge=0)
    watchers_serial: int = Field(ge=0)


class Until(_Line):
    """Message to a room of a cluster: the time until which it may run unless it hears a later one.

    Args:
        at: Time on the machine's monotonic clock, which all its processes share [s].
    """

    kind: Literal["until"] = "until"
    at: float


class Stop(_Line):
    """Message to a room: close the clients' connections and end."""

    kind: Literal["stop"] = "stop"


class ReadAgain(_Line):
    """Message to a room: read the key files again."""

    kind: Literal["read_again"] = "read_again"


FromRoom = Ready | Failed | Left | Report | Measured
ToRoom = Allow | Stop | ReadAgain | Until
Line = FromRoom | ToRoom
_KINDS: TypeAdapter[Line] = TypeAdapter(Annotated[Line, Field(discriminator="kind")])
_LINES = JsonLines(_KINDS)
encode, decode = _LINES.encode, _LINES.decode


# Before its first `Allow` a room may seat nobody.
NO_SEATS = Allow(users=0, watchers=0, users_serial=0, watchers_serial=0)
