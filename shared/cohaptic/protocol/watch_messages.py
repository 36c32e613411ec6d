"""Messages of connections that only watch, in addition to those of `messages.py`, as JSON text.

client -> server    watch, first; set_view, set_latency, moderate
server -> client    watching, first; latency, moderated, put_out; to all: user_joined, user_left,
                    restraints, error

The messages about the other visitors, in both directions, are in `control/company.py`.

`decode_client_message` decodes the messages of both kinds of client, those that touch and those
that watch: the first message of a connection decides which kind it is.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, TypeAdapter

from cohaptic.protocol.control.company import (
    Aim,
    Aimed,
    Company,
    Declined,
    Follow,
    Point,
    Pointed,
    Present,
)
from cohaptic.protocol.control.message import (
    ControlMessage,
    Name,
    SetName,
    WithSecrets,
)
from cohaptic.protocol.messages import (
    BodyInfo,
    Bye,
    Come,
    Error,
    Hello,
    Mark,
    Period,
    Recorded,
    Restraints,
    RoomUser,
    SetLaw,
    Token,
    UserJoined,
    UserLeft,
    decode_text,
    wrong_version,
)
from cohaptic.protocol.version import PROTOCOL_VERSION

MAX_WATCHING_TEXT = 65_536  # characters of `watching` for the fullest room
MAX_RATE = 60.0  # frames per second; screens show no more
MAX_INJECTED_DELAY = 1.0  # s, each way
MAX_INJECTED_JITTER = 0.5  # s
MAX_INJECTED_TAIL = 0.1  # s, of whose tenfold no message is later
MAX_NETWORK_TEXT = 200  # characters of the words for a link

MAX_PUT_OUT = 64  # banned names in one message to an administrator

EncodingName = Literal["frames", "forces"]
ModerationName = Literal[
    "mute", "unmute", "kick", "ban", "unban", "freeze", "unfreeze", "reset", "force_budget",
    "record", "end_recording",
]  # fmt: skip
MeshForm = Literal["exact", "quantised"]
Rate = Annotated[float, Field(ge=1.0, le=MAX_RATE)]
Model = Annotated[str, Field(pattern="^[0-9a-f]{32}$")]
Network = Annotated[str, Field(max_length=MAX_NETWORK_TEXT)]


class Watch(WithSecrets):
    """First message of a connection that only watches.

    Args:
        protocol: Version of the protocol that the client speaks.
        encoding: `frames` for scenes with the surface; `forces` for scenes without, for a client
            that computes the surface from Green's functions. A body without Green's functions is
            served as `frames`.
        rate: Largest rate of scene frames [1/s].
        mesh: Form of the resting mesh; `quantised` is shorter, and not exact.
        token: As in a hello.
        company: Whether the client wants messages about other visitors. Not on the wire if False.
    """

    type: Literal["watch"] = "watch"
    protocol: int
    encoding: EncodingName = "frames"
    rate: Rate = 30.0
    mesh: MeshForm = "exact"
    token: Token | None = Field(default=None, repr=False)
    company: bool = False


class SetView(ControlMessage):
    """Change encoding and rate of the scene frames.

    Args:
        encoding: As in `watch`.
        rate: As in `watch`.
    """

    type: Literal["set_view"] = "set_view"
    encoding: EncodingName
    rate: Rate = 30.0


class SetLatency(ControlMessage):
    """Inject latency between a user and the server; refused unless the server allows it.

    Args:
        user: Number of the user; ignored if that user is not (or no longer) in the room.
        delay: Delay each way, so that the round trip grows by twice as much [s]; 0 for no delay;
            None for that of the network.
        jitter: Largest extra delay of a message, each way [s]; None for that of the network.
        network: Words for the rest of the link, as `cohaptic.simulated.networks` reads them; empty
            for a link without losses and stalls.
    """

    type: Literal["set_latency"] = "set_latency"
    user: int = Field(ge=1, lt=2**32)
    delay: float | None = Field(default=None, ge=0.0, le=MAX_INJECTED_DELAY)
    jitter: float | None = Field(default=None, ge=0.0, le=MAX_INJECTED_JITTER)
    network: Network = ""


class Moderate(ControlMessage):
    """Ask for an administrator's action in the room; refused unless the token grants roomAdmin.

    For `record` and `end_recording` the grant roomRecord is enough.

    Args:
        user: Number of the user concerned; ignored if that user is not in the room.
        force: For `force_budget`: largest sum of all users' forces that the body gets [N]; None for
            the server's own limit alone.
        name: For `unban`: name that the banned user had in the room.
    """

    type: Literal["moderate"] = "moderate"
    action: ModerationName
    user: int | None = Field(default=None, ge=1, lt=2**32)
    force: float | None = Field(default=None, ge=0.0, le=1000.0)
    name: Name | None = None


class Watching(WithSecrets):
    """The server's answer to a `watch` that it accepts; the rest mesh and scenes follow.

    Args:
        protocol: Version of the protocol that the server speaks.
        simulation_period: Time between ticks, N T [s].
        to_wall: Unix time less the server's clock, whose zero is arbitrary [s].
        body: Body that the users of the room touch.
        model: Identifier of the body's Green's functions, the same on any server; None if the
            surface is not a sum of them.
        users: Users who joined before.
        allow_latency: Whether `set_latency` is allowed.
        allow_fixed_gains: Whether clients that touch may choose their gains.
        allow_upload: Whether a page on the server's machine may upload its own object.
        can_touch: Whether this client's token also allows it to touch.
        room_admin: Whether this client may send `moderate`.
        can_record: Whether this client may record the room.
        session: As in a welcome.
    """

    type: Literal["watching"] = "watching"
    protocol: int = PROTOCOL_VERSION
    simulation_period: Period
    to_wall: float = 0.0
    body: BodyInfo
    model: Model | None
    users: tuple[RoomUser, ...]
    allow_latency: bool
    allow_fixed_gains: bool
    allow_upload: bool = False
    can_touch: bool = True
    room_admin: bool = False
    can_record: bool = False
    session: Token | None = Field(default=None, repr=False)


class Latency(ControlMessage):
    """Latency injected between a user and the server; sent at each change and to a new watcher.

    Args:
        user: Number of the user.
        delay: Delay each way [s].
        jitter: Largest extra delay of a message, each way [s].
        network: Words for the rest of the link, as in `SetLatency`.
    """

    type: Literal["latency"] = "latency"
    user: int
    delay: float
    jitter: float
    network: str = ""


class Moderated(ControlMessage):
    """The answer to a `moderate` on which the server has acted; sent only to the asking client.

    Args:
        action: Action of the request.
        user: User of the request.
        done: False if the user has left meanwhile.
    """

    type: Literal["moderated"] = "moderated"
    action: ModerationName
    user: int | None
    done: bool


class PutOut(ControlMessage):
    """Users who may not come back; sent only to administrators, first and at each change.

    Args:
        names: Names that these users had, the newest last; at most the newest 64.
    """

    type: Literal["put_out"] = "put_out"
    names: Annotated[tuple[Name, ...], Field(max_length=MAX_PUT_OUT)]


WatchRequest = SetView | SetLatency | Moderate | Mark | Present | Follow | Aim | Point
ClientMessage = Hello | Come | SetName | SetLaw | Mark | Bye | Watch | WatchRequest
WatchControl = (
    Watching | UserJoined | UserLeft | Restraints | Recorded | Latency | Moderated | PutOut
    | Company | Aimed | Pointed | Declined | Error
)  # fmt: skip

_CLIENT: TypeAdapter[ClientMessage] = TypeAdapter(
    Annotated[ClientMessage, Field(discriminator="type")]
)
_SERVER: TypeAdapter[WatchControl] = TypeAdapter(
    Annotated[WatchControl, Field(discriminator="type")]
)


def decode_client_message(text: str) -> ClientMessage:
    """Decode the message of any client; raises RemoteProtocolError for any invalid text.

    A first message of another protocol version is reported as such, even if its other fields have
    changed.
    """
    message = decode_text(_CLIENT, text)
    if isinstance(message, Hello | Watch) and message.protocol != PROTOCOL_VERSION:
        raise wrong_version(message.protocol)
    return message


def decode_watch_control(text: str) -> WatchControl:
    """Decode a server's message to a watcher; raises RemoteProtocolError for any invalid text."""
    return decode_text(_SERVER, text, MAX_WATCHING_TEXT)
