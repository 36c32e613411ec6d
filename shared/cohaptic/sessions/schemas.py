"""Which channel of the file has which entries, and how the file itself describes them.

What is small is JSON, described by JSON Schema. What is large or comes in every tick is protobuf,
described by its `FileDescriptorSet`: tools that know neither us nor our frames read its numbers.
Frames of our wire protocol stay the bytes that they were, in a field `frame`.

    topic               entry       encoding
    /session            SessionInfo json
    /room/joined        Joined      json        inputs of the room, in the order of its work
    /room/left          Left        json
    /room/law           LawSet      json
    /room/heard         Heard       protobuf    frame: a contact sample
    /room/tick          Ticked      protobuf
    /room/passed_over   PassedOver  json
    /room/restrained    Restrained  json
    /room/budget        BudgetSet   json
    /room/reset         BodyReset   json
    /room/asked         Asked       json
    /room/solved        Solved      json
    /room/patch         Patched     protobuf    frame: a patch
    /room/mesh          Mesh        protobuf    frame: a resting mesh
    /room/scene         Shown       protobuf
    /client/rows        Rows        protobuf    all columns at the full rate
    /client/rows_lost   RowsLost    json
    /client/link        Link        protobuf
    /marks              Mark        json
    /events             Happened    json
    /left_out           LeftOut     json

`plots.py` adds channels for Foxglove, which our reader passes over.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from cohaptic.sessions.entries import (
    Asked,
    BodyReset,
    BudgetSet,
    Happened,
    Heard,
    Joined,
    LawSet,
    Left,
    LeftOut,
    Link,
    Mark,
    Mesh,
    PassedOver,
    Patched,
    Restrained,
    Rows,
    RowsLost,
    SessionInfo,
    Shown,
    Solved,
    Ticked,
    Written,
)
from cohaptic.sessions.wire import Field, Kind, Message, description

PACKAGE = "cohaptic"
PROFILE = "cohaptic"  # of the MCAP file
# Form of the file; a reader refuses a newer one. It stands in the library's name of the header.
FORM = 1

_T = Field(1, "t", Kind.DOUBLE)
_USER = Field(2, "user", Kind.UINT)

HEARD = Message("Heard", (_T, _USER, Field(3, "frame", Kind.BYTES)))
TICKED = Message("Ticked", (_T, Field(2, "tick", Kind.UINT)))
PATCHED = Message(
    "Patched", (_T, Field(3, "tick", Kind.UINT), _USER, Field(4, "frame", Kind.BYTES))
)
MESH = Message("Mesh", (_T, Field(2, "frame", Kind.BYTES)))
SHOWN = Message("Shown", (_T, Field(2, "tick", Kind.UINT), Field(3, "frame", Kind.BYTES)))
# `columns` has one name a line. Numbers stand column after column: `exact` has those of the columns
# that `exact_columns` names, `values` those of the others, rounded to 32 bits. A message for each
# column would say the same, and take ten times as long to be made.
ROWS = Message(
    "Rows",
    (
        _T,
        _USER,
        Field(3, "to_server", Kind.DOUBLE),
        Field(4, "error", Kind.DOUBLE),
        Field(5, "columns", Kind.STRING),
        Field(6, "exact_columns", Kind.STRING),
        Field(7, "exact", Kind.DOUBLES),
        Field(8, "values", Kind.FLOATS),
    ),
)
LINK = Message(
    "Link",
    (
        _T,
        _USER,
        Field(3, "round_trip", Kind.DOUBLE),
        Field(4, "jitter", Kind.DOUBLE),
        Field(5, "clock_offset", Kind.DOUBLE),
        Field(6, "clock_error", Kind.DOUBLE),
    ),
)


@dataclass(frozen=True, slots=True)
class Channel:
    """Channel of the file.

    Args:
        entry: Class of its entries.
        topic: Name of the channel.
        message: Table of its messages if they are protobuf; None if they are JSON.
    """

    entry: type[Written]
    topic: str
    message: Message | None = None

    @property
    def encoding(self) -> str:
        """Encoding of the messages, in the words of MCAP."""
        return "protobuf" if self.message else "json"

    @property
    def schema(self) -> Schema:
        """Description of the messages."""
        if self.message is not None:
            data = description(PACKAGE, self.message)
            return Schema(f"{PACKAGE}.{self.message.name}", "protobuf", data)
        text = json.dumps(adapter(self.entry).json_schema(), sort_keys=True)
        return Schema(f"{PACKAGE}.{self.entry.__name__}", "jsonschema", text.encode())


@dataclass(frozen=True, slots=True)
class Schema:
    """Description of a channel's messages, as MCAP has it: name, encoding and bytes."""

    name: str
    encoding: str
    data: bytes


CHANNELS = (
    Channel(SessionInfo, "/session"),
    Channel(Joined, "/room/joined"),
    Channel(Left, "/room/left"),
    Channel(LawSet, "/room/law"),
    Channel(Heard, "/room/heard", HEARD),
    Channel(Ticked, "/room/tick", TICKED),
    Channel(PassedOver, "/room/passed_over"),
    Channel(Restrained, "/room/restrained"),
    Channel(BudgetSet, "/room/budget"),
    Channel(BodyReset, "/room/reset"),
    Channel(Asked, "/room/asked"),
    Channel(Solved, "/room/solved"),
    Channel(Patched, "/room/patch", PATCHED),
    Channel(Mesh, "/room/mesh", MESH),
    Channel(Shown, "/room/scene", SHOWN),
    Channel(Rows, "/client/rows", ROWS),
    Channel(RowsLost, "/client/rows_lost"),
    Channel(Link, "/client/link", LINK),
    Channel(Mark, "/marks"),
    Channel(Happened, "/events"),
    Channel(LeftOut, "/left_out"),
)
BY_ENTRY: dict[type, Channel] = {channel.entry: channel for channel in CHANNELS}
BY_TOPIC = {channel.topic: channel for channel in CHANNELS}


_ADAPTERS: dict[type, Any] = {}


def adapter(entry: type[Written]) -> Any:
    """Return what turns entries of a class into JSON, and checks JSON that claims to be one."""
    if entry not in _ADAPTERS:  # each takes a millisecond to be made
        from pydantic import TypeAdapter

        _ADAPTERS[entry] = TypeAdapter(entry)
    return _ADAPTERS[entry]
