"""Handshake and control messages as JSON text: rare events, sent in order and never dropped.

client -> server    hello, come, set_name, set_law, mark, bye
server -> client    place, called, welcome, named, user_joined, user_left, restraints, recorded,
                    error

`watch_messages.py` has the further messages of a connection that only watches.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    StrictBool,
    StrictFloat,
    StrictInt,
    TypeAdapter,
    ValidationError,
    model_serializer,
)

from cohaptic.control.law import DEFAULT_LAW, Law
from cohaptic.errors import CloseCode, ProtocolError, RemoteProtocolError, one_line
from cohaptic.protocol.control.message import (
    SECRETS,
    Capabilities,
    ChosenName,
    ControlMessage,
    LoopRules,
    Name,
    Named,
    SetName,
    WithSecrets,
)
from cohaptic.protocol.frame import MAX_POSITION
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.vec import ZERO, Vec3, add, sub

MAX_TEXT = 4096  # characters of one control message
MAX_WELCOME_TEXT = 16_384  # characters of a server's longest message, a welcome to the fullest room
MAX_TOKEN = 2048  # characters; the server's own have about 400
MAX_FIELD = 64  # characters; the longest of cohaptic's own has 20
_FIELD = re.compile(rf"[a-z0-9_.]{{1,{MAX_FIELD}}}")
MAX_BODY_NAME = 1024  # characters; a file's name, with room for its folders
MIN_PERIOD, MAX_PERIOD = 0.005, 0.1  # s
M = TypeVar("M")
GeometryName = Literal["plane", "sphere", "mesh"]

# Printable ASCII, long enough that nobody guesses it.
Key = Annotated[str, Field(min_length=16, max_length=64, pattern=r"^[!-~]+$")]

# A signed token; the server decides whether it is valid.
Token = Annotated[str, Field(min_length=1, max_length=MAX_TOKEN, pattern=r"^[!-~]+$")]

MAX_MARK_FIELDS = 16
MAX_MARK_AGE = 60.0  # s; a mark that waited for longer, on a lost link, would be a guess
MAX_MARK_TIME = 1e9  # s, as of a clock in rows
MarkText = Annotated[str, Field(min_length=1, max_length=200)]

Coordinate = Annotated[float, Field(ge=-MAX_POSITION, le=MAX_POSITION)]  # [m]
# Coordinate in the frame of a file [m]; no object lies farther from its origin than 1e7 times its
# own length, which is 5 m at most (`objects/checked_cells.py` of the server).
FileCoordinate = Annotated[float, Field(ge=-1e8, le=1e8)]
# Simulation rates of 10 to 200 Hz, as for the server's settings. A client that accepted any value
# could be made to ramp its surface in no time, or for ever.
Period = Annotated[float, Field(ge=MIN_PERIOD, le=MAX_PERIOD)]  # [s]


class FixedGains(ControlMessage):
    """Gains that a client asks for instead of the server's choice, for experiments.

    Args:
        k_h: K_h [N/m].
        integral_gain: I [N/(m s)].
    """

    k_h: float = Field(gt=0.0, le=1e6)
    integral_gain: float = Field(default=0.0, ge=0.0, le=1e9)


class Hello(WithSecrets):
    """First message of a client.

    Args:
        protocol: Version of the protocol that the client speaks.
        name: Name that the other users see; unique in the room.
        law: Local model that the client runs.
        max_stiffness: Largest gain that the device renders stably [N/m].
        max_force: Largest force of the device; the server applies no more to the body [N].
        damping_budget: Largest damping that the client's passivity layer may render on this device
            (Colgate); a smaller budget means a longer lag of the room (science 3.8) [N s/m].
        geometry: Local surface that the client wants; with `mesh` the resting mesh comes first.
        friction: Whether the force may have a part along the surface; patches then carry the
            compliance of the contact in all directions.
        fixed_gains: Gains instead of the server's choice; refused unless the server allows them.
        key: Secret made by the client, with which it gets its name again when it comes back; the
            server shows the key to nobody. Not on the wire if None.
        token: Token of an invitation or of a session. Not on the wire if None.
        capabilities: Capabilities of the device, only shown to people. Not on the wire if None.
        wait: Whether the client waits for a seat if the room is full. Not on the wire if False.
        models: Whether the client moves models of the hands (science 3.15); patches then carry
            partners, and samples the deflection. Not on the wire if False.
        rules: Difference of the client's loop from the rules of this version. Not on the wire if
            None.
    """

    type: Literal["hello"] = "hello"
    protocol: int
    name: ChosenName
    law: Law = DEFAULT_LAW
    max_stiffness: float = Field(default=1000.0, gt=0.0, le=1e6)
    max_force: float = Field(default=10.0, gt=0.0, le=100.0)
    damping_budget: float = Field(default=0.0, ge=0.0, le=1000.0)
    geometry: GeometryName = "plane"
    friction: bool = False
    fixed_gains: FixedGains | None = None
    key: Key | None = Field(default=None, repr=False)
    token: Token | None = Field(default=None, repr=False)
    capabilities: Capabilities | None = None
    wait: bool = False
    models: bool = False
    rules: LoopRules | None = None


class Come(ControlMessage):
    """The answer of a client to `called`: the client takes the seat."""

    type: Literal["come"] = "come"


class SetLaw(ControlMessage):
    """Change the local model while in contact; the next patches carry the gains of the new model.

    Args:
        law: Local model from now on.
        fixed_gains: As in the hello.
    """

    type: Literal["set_law"] = "set_law"
    law: Law
    fixed_gains: FixedGains | None = None


class Bye(ControlMessage):
    """A client ends its contact and leaves."""

    type: Literal["bye"] = "bye"


class BodyInfo(ControlMessage):
    """Position and size of the body, for a client before its first patch.

    Args:
        center: Centre of the body's resting surface in the world frame [m].
        radius: Radius of the sphere round `center` that holds the resting surface [m].
        contact_radius: Contact radius of the pressure under a contact (science 3.5) [m].
        origin: Point of the body's file, times its scale, at which the world frame has its origin,
            since an object from a file is served in the middle of the world [m]. Not on the wire
            if zero.
    """

    name: Annotated[str, Field(max_length=MAX_BODY_NAME)]
    center: tuple[Coordinate, Coordinate, Coordinate]
    radius: float = Field(gt=0.0, le=MAX_POSITION)
    contact_radius: float = Field(gt=0.0, le=MAX_POSITION)
    origin: tuple[FileCoordinate, FileCoordinate, FileCoordinate] = ZERO

    @model_serializer(mode="wrap")
    def _without_zero(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        fields: dict[str, Any] = handler(self)
        if self.origin == ZERO:
            del fields["origin"]
        return fields

    def to_file(self, point: Vec3) -> Vec3:
        """Return a point of the world frame in the frame of the body's file [m]."""
        return add(point, self.origin)

    def from_file(self, point: Vec3) -> Vec3:
        """Return a point of the frame of the body's file in the world frame [m]."""
        return sub(point, self.origin)


class RoomUser(WithSecrets):
    """One user of the room.

    Args:
        user: Number of the user.
        rules: As in its hello. Not on the wire if None.
    """

    user: int
    name: Name
    rules: LoopRules | None = None


class Welcome(WithSecrets):
    """The server's answer to a hello that it accepts.

    Args:
        protocol: Version of the protocol that the server speaks.
        user: Number of this user in the room.
        name: Name under which this user joined.
        simulation_period: Time between patches, N T [s].
        to_wall: Unix time less the server's clock, whose zero is arbitrary [s].
        body: Body that every user of the room touches.
        users: Users who joined before, without their rules.
        session: Token with which this client can come back. Not on the wire if None.
    """

    type: Literal["welcome"] = "welcome"
    protocol: int = PROTOCOL_VERSION
    user: int
    name: Name
    simulation_period: Period
    to_wall: float = 0.0
    body: BodyInfo
    users: tuple[RoomUser, ...]
    session: Token | None = Field(default=None, repr=False)


class Place(WithSecrets):
    """Place of a client in the queue for a seat; sent at each change, and every 2 s.

    Args:
        place: Place in the queue, from 1.
        of: Number of clients in the queue.
        session: As in a welcome, sent in the first of these messages: an invitation may be valid
            for one connection only, and a client that loses its connection needs a token to come
            back. Not on the wire if None.
    """

    type: Literal["place"] = "place"
    place: int = Field(ge=1)
    of: int = Field(ge=1)
    session: Token | None = Field(default=None, repr=False)


class Called(ControlMessage):
    """Offer a seat to a waiting client, which must answer `come` within the given time [s]."""

    type: Literal["called"] = "called"
    within: float = Field(gt=0.0)


class UserJoined(WithSecrets):
    """Another user has joined, or has changed its name.

    Args:
        user: Number of the user.
        name: Name of the user.
        rules: As in its hello. Not on the wire if None.
    """

    type: Literal["user_joined"] = "user_joined"
    user: int
    name: str
    rules: LoopRules | None = None


class UserLeft(ControlMessage):
    """Another user has left."""

    type: Literal["user_left"] = "user_left"
    user: int
    name: str
    reason: str


class Restraints(ControlMessage):
    """Users whose force an administrator keeps from the body; sent at changes and to new clients.

    Args:
        frozen: Whether no user's force acts on the body.
        muted: Numbers of the users whose force does not act on the body.
    """

    type: Literal["restraints"] = "restraints"
    frozen: bool = False
    muted: tuple[int, ...] = ()


class Recorded(ControlMessage):
    """Whether the session is recorded from now on; sent at changes, and to new clients if it is.

    Args:
        on: Whether it is recorded. A client may then send rows of its loop and marks.
    """

    type: Literal["recorded"] = "recorded"
    on: bool


class Mark(ControlMessage):
    """Set a mark in the recording, such as the begin of a trial; no effect where nothing records.

    Args:
        text: Text of the mark.
        fields: Further values.
        at: The marked moment on the server's clock [s]; None if the sender does not know it.
        error: Bound on the error of `at` [s]; None if the sender does not know it.
        ago: Time since the marked moment, for a server without `at` [s].
    """

    type: Literal["mark"] = "mark"
    text: MarkText
    fields: dict[MarkText, MarkText | StrictBool | StrictInt | StrictFloat | None] = Field(
        default={}, max_length=MAX_MARK_FIELDS
    )
    at: float | None = Field(default=None, ge=-MAX_MARK_TIME, le=MAX_MARK_TIME)
    error: float | None = Field(default=None, ge=0.0, le=MAX_MARK_AGE)
    ago: float = Field(default=0.0, ge=0.0, le=MAX_MARK_AGE)


class Error(ControlMessage):
    """Reason why the server ends this session; the close of the connection follows.

    Args:
        code: Close code of the connection.
        field: Field, message or resource at fault, such as `name`, `token` or `seats`; empty where
            there is none. Programs decide by this and the code.
        message: The reason as one sentence, for people.
    """

    type: Literal["error"] = "error"
    code: int
    field: Annotated[str, Field(max_length=MAX_FIELD)] = ""
    message: str

    @classmethod
    def of(cls, error: ProtocolError) -> Error:
        """Return the message that tells a peer an error."""
        # What a peer calls its own fields is its own text, and can have any characters.
        field = error.field if _FIELD.fullmatch(error.field) else ""
        return cls(code=error.code.value, field=field, message=str(error))


ClientControl = Hello | Come | SetName | SetLaw | Mark | Bye
ServerControl = (
    Place | Called | Welcome | Named | UserJoined | UserLeft | Restraints | Recorded | Error
)

_CLIENT: TypeAdapter[ClientControl] = TypeAdapter(
    Annotated[ClientControl, Field(discriminator="type")]
)
_SERVER: TypeAdapter[ServerControl] = TypeAdapter(
    Annotated[ServerControl, Field(discriminator="type")]
)


def encode_control(message: ControlMessage) -> str:
    """The JSON text of a control message."""
    return message.model_dump_json()


def decode_client_control(text: str) -> ClientControl:
    """Decode a client's message; raises RemoteProtocolError for any invalid text.

    A hello of another protocol version is reported as such, even if its other fields have changed.
    """
    message = decode_text(_CLIENT, text)
    if isinstance(message, Hello) and message.protocol != PROTOCOL_VERSION:
        raise wrong_version(message.protocol)
    return message


def decode_server_control(text: str) -> ServerControl:
    """Decode the server's message; raises RemoteProtocolError for any invalid text."""
    return decode_text(_SERVER, text, MAX_WELCOME_TEXT)


def wrong_version(theirs: object) -> RemoteProtocolError:
    """The error for a peer that speaks another version of the protocol."""
    return RemoteProtocolError(
        "protocol version",
        theirs,
        f"{PROTOCOL_VERSION}: install the same cohaptic on both sides",
        CloseCode.WRONG_VERSION,
        "protocol",
    )


def decode_text(adapter: TypeAdapter[M], text: str, limit: int = MAX_TEXT) -> M:
    """Decode a message of one of the adapter's types; raises RemoteProtocolError if invalid."""
    if len(text) > limit:
        raise RemoteProtocolError(
            "control message length", len(text), f"<= {limit} characters", field="length"
        )
    try:
        return adapter.validate_json(text)
    except ValidationError as error:  # the error has the whole text, with its secrets
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"]) or "control message"
        if where.endswith("protocol"):
            raise wrong_version(first["input"]) from None
        # Field name and message may quote the peer's text, such as an unknown type.
        subject, problem = one_line(where), one_line(str(first["msg"]))
        value = "not shown" if first["loc"][-1:] and first["loc"][-1] in SECRETS else first["input"]
        raise RemoteProtocolError(subject, value, problem) from None
