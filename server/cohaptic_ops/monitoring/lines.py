"""Lines of JSON from a server to the process of its admin port."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from cohaptic_ops.monitoring.json_lines import JsonLines
from cohaptic_ops.monitoring.metrics import RoomMetrics, ServerHealth

LONGEST = 256 * 1024  # bytes; a room of 64 users takes 20 KB, the health of 200 rooms 40 KB


class _Line(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class ServerLine(_Line):
    """How the server is; in place of the one before."""

    kind: Literal["server"] = "server"
    health: ServerHealth


class RoomLine(_Line):
    """What a room tells; in place of the one before of the same room."""

    kind: Literal["room"] = "room"
    room: str
    metrics: RoomMetrics


class OpenLine(_Line):
    """The other way, once: the admin port is open.

    Args:
        url: URL of it.
        missing: A sentence for each address of its name that this machine does not have.
    """

    kind: Literal["open"] = "open"
    url: str
    missing: tuple[str, ...] = ()


class RefusedLine(_Line):
    """The other way, once: it cannot be opened.

    Args:
        name, value, limit: As of a `SettingError`.
    """

    kind: Literal["refused"] = "refused"
    name: str
    value: str
    limit: str


Line = ServerLine | RoomLine | OpenLine | RefusedLine
_KINDS: TypeAdapter[Line] = TypeAdapter(Annotated[Line, Field(discriminator="kind")])
_LINES = JsonLines(_KINDS)
encode, decode = _LINES.encode, _LINES.decode
