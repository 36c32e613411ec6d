"""Messages between a server and the process of its admin port, each as a line of JSON."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from cohaptic_ops.monitoring.json_lines import JsonLines
from cohaptic_ops.monitoring.metrics import RoomMetrics, ServerHealth

LONGEST = 256 * 1024  # bytes; a room of 64 users takes 20 KB, the health of 200 rooms 40 KB


class _Line(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class ServerLine(_Line):
    """State of the server; replaces the state of the previous line."""

    kind: Literal["server"] = "server"
    health: ServerHealth


class RoomLine(_Line):
    """Metrics of a room; they replace the metrics of the room's previous line."""

    kind: Literal["room"] = "room"
    room: str
    metrics: RoomMetrics


class OpenLine(_Line):
    """Message from the process to the server, sent once: the admin port is open.

    Args:
        url: URL of the admin port.
        missing: Sentence for each address of its host name that this machine does not have.
    """

    kind: Literal["open"] = "open"
    url: str
    missing: tuple[str, ...] = ()


class RefusedLine(_Line):
    """Message from the process to the server, sent once: the admin port cannot be opened.

    Args:
        name, value, limit: Fields of the `SettingError`.
    """

    kind: Literal["refused"] = "refused"
    name: str
    value: str
    limit: str


Line = ServerLine | RoomLine | OpenLine | RefusedLine
_KINDS: TypeAdapter[Line] = TypeAdapter(Annotated[Line, Field(discriminator="kind")])
_LINES = JsonLines(_KINDS)
encode, decode = _LINES.encode, _LINES.decode
