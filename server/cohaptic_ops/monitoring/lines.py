"""Messages between a server and the process of its admin port, each as a line of JSON."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from cohaptic_ops.monitoring.json_lines import JsonLines
from cohaptic_ops.monitoring.metrics import RoomMetrics, ServerHealth

LONGEST = 256 * 1024  # bytes; a room of 64 users takes 20 KB, the health of 1,000 rooms 200 KB


class _Line(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class ServerLine(_Line):
    """Message with the state of the server; it replaces the previous such message."""

    kind: Literal["server"] = "server"
    health: ServerHealth


class RoomLine(_Line):
    """Message with the metrics of a room; it replaces the room's previous message."""

    kind: Literal["room"] = "room"
    room: str
    metrics: RoomMetrics


class OpenLine(_Line):
    """Message from the process to the server, sent once: the admin port is open.

    Args:
        url: URL of the admin port.
        missing: A sentence for each address of the port's host name that this machine does not
            have.
    """

    kind: Literal["open"] = "open"
    url: str
    missing: tuple[str, ...] = ()


class RefusedLine(_Line):
    """Message from the process to the server, sent once: the admin port cannot be opened.

    Args:
        name, value, limit: Fields of the `SettingError` that says why.
    """

    kind: Literal["refused"] = "refused"
    name: str
    value: str
    limit: str


Line = ServerLine | RoomLine | OpenLine | RefusedLine
_KINDS: TypeAdapter[Line] = TypeAdapter(Annotated[Line, Field(discriminator="kind")])
_LINES = JsonLines(_KINDS)
encode, decode = _LINES.encode, _LINES.decode
