"""Messages between the nodes of a cluster, as lines of JSON. No I/O."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from cohaptic_ops.monitoring.json_lines import JsonLines

LONGEST = 1 << 20  # bytes of a line; a room takes about 40
ACCEPTED = b"+"  # the answer to `Pass`; without it the connection is closed

_Name = Annotated[str, Field(max_length=80)]
_Rooms = dict[_Name, Annotated[int, Field(ge=0)]]


class _Line(BaseModel):
    # Unknown fields are those of a newer version, which may run on other nodes for a while.
    model_config = ConfigDict(frozen=True, extra="ignore")


class There(_Line):
    """Where a room is.

    Args:
        address: Address of its node, HOST:PORT.
        epoch: Number of its owner.
        users, watchers: Numbers of people in it, as its owner has last told.
    """

    address: _Name
    epoch: int = Field(ge=0)
    users: int = Field(ge=0)
    watchers: int = Field(ge=0)


class Ask(_Line):
    """Message to a witness, sent several times in a term.

    Args:
        owner: Unique name of the asking process.
        address: Address of its node, HOST:PORT.
        rooms: Number (epoch) under which it owns or wants to own each room.
        freed: Rooms that it owned or wanted no more, with the last numbers of its claims.
        people: Numbers of users and watchers in rooms that it owns.
        finds: Rooms that somebody wants to go to through this node.
        lists: Whether to list all rooms.
        processors: Number of processors of its node; 0 if it takes no more rooms.
    """

    kind: Literal["ask"] = "ask"
    owner: _Name
    address: _Name
    rooms: _Rooms = {}
    freed: _Rooms = {}
    people: dict[_Name, tuple[int, int]] = {}
    finds: tuple[_Name, ...] = ()
    lists: bool = False
    processors: float = Field(default=0.0, ge=0.0, allow_inf_nan=False)


class Answer(_Line):
    """Answer of a witness.

    Args:
        granted: Rooms that are granted, with their numbers.
        refused: Rooms that are not, with the newest number of an owner.
        placed: Rooms without an owner whose place is the asking node.
        found: Places of the rooms that the process has asked for, or of all; without those that
            nobody owns.
        listed: Whether `found` has all rooms.
    """

    kind: Literal["answer"] = "answer"
    granted: _Rooms = {}
    refused: _Rooms = {}
    placed: tuple[_Name, ...] = ()
    found: dict[_Name, There] = {}
    listed: bool = False


class Pass(_Line):
    """Message before the bytes of a connection that is passed on; `ACCEPTED` answers it.

    Args:
        room: Name of the room.
        epoch: Number of the owner that the connection is for.
        source: Network address against whose rate limits the connection counts.
    """

    kind: Literal["pass"] = "pass"
    room: _Name
    epoch: int = Field(ge=0)
    source: Annotated[str, Field(max_length=64, pattern=r"^[\x20-\x7e]*$")]


Line = Ask | Answer | Pass
_KINDS: TypeAdapter[Line] = TypeAdapter(Annotated[Line, Field(discriminator="kind")])
_LINES = JsonLines(_KINDS)
encode, decode = _LINES.encode, _LINES.decode


class Command(_Line):
    """Message to the program that speaks with the engine.

    Args:
        place: Room to place on a machine.
        cores: Processors that it needs.
        at: Machine (IP address) on which it is already; empty for any machine.
        remove: Room to place nowhere any more.
    """

    place: _Name = ""
    cores: float = Field(default=0.0, ge=0.0)
    at: _Name = ""
    remove: _Name = ""


class Placed(_Line):
    """Message of the program that speaks with the engine.

    Args:
        rooms: Machine (IP address) of each room; empty while it has none.
        more: Whether these are some rooms only, which have just got a machine.
    """

    rooms: dict[_Name, _Name] = {}
    more: bool = False
