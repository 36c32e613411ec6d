"""The client's half of the protocol as a state machine without I/O."""

from __future__ import annotations

from enum import Enum

from cohaptic.control.law import Law
from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.fields import FrameKind
from cohaptic.protocol.frame import HEADER
from cohaptic.protocol.messages import (
    Bye,
    Called,
    Come,
    Error,
    Hello,
    Place,
    Recorded,
    Restraints,
    UserJoined,
    UserLeft,
    Welcome,
    decode_server_control,
    encode_control,
)
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.rest_mesh import RestMesh


class State(Enum):
    """State of a session; the value describes it in words."""

    AWAIT_WELCOME = "waits for welcome"
    JOINED = "joined"
    CLOSED = "closed"


Event = (
    Place | Called | Welcome | RestMesh | Patch | UserJoined | UserLeft | Restraints | Recorded
    | Error
)  # fmt: skip

ALLOWED: dict[State, tuple[type[Event], ...]] = {
    State.AWAIT_WELCOME: (Place, Called, Welcome, Error),
    State.JOINED: (RestMesh, Patch, UserJoined, UserLeft, Restraints, Recorded, Error),
    State.CLOSED: (),
}


class ClientSession:
    """One connection to a server, seen from the client.

    Args:
        laws: Laws that this client has requested. A patch for another law is refused, because a
            server could change the force on a resting hand by switching between laws.

    Attributes:
        state: State of the session.
    """

    def __init__(self, laws: tuple[Law, ...] = tuple(Law)) -> None:
        self.state = State.AWAIT_WELCOME
        self._laws = laws
        self._vertices: int | None = None  # of the resting mesh; None before it has come

    @staticmethod
    def greeting(hello: Hello) -> str:
        """Encode the first message of the connection."""
        return encode_control(hello)

    @staticmethod
    def farewell() -> str:
        """Return the last message of the connection, encoded."""
        return encode_control(Bye())

    @staticmethod
    def coming() -> str:
        """Encode the answer to the server's message `called`, which offers a free seat."""
        return encode_control(Come())

    def receive(self, data: str | bytes) -> Event:
        """Decode and check one message from the server; return the message.

        Raises:
            RemoteProtocolError: The server broke the protocol; the session is over.
        """
        try:
            message = _decode(data) if isinstance(data, bytes) else decode_server_control(data)
            if not isinstance(message, ALLOWED[self.state]):
                allowed = (
                    " or ".join(event.__name__ for event in ALLOWED[self.state]) or "nothing more"
                )
                kind = type(message).__name__
                raise RemoteProtocolError("message", kind, f"{allowed}: {self.state.value}")
            if isinstance(message, RestMesh):
                self._take(message)
            elif isinstance(message, Patch):
                self._check(message)
        except RemoteProtocolError:
            self.state = State.CLOSED
            raise
        if isinstance(message, Welcome):
            self.state = State.JOINED
        elif isinstance(message, Error):
            self.state = State.CLOSED
        return message

    def _take(self, mesh: RestMesh) -> None:
        if self._vertices is not None:
            raise RemoteProtocolError("rest mesh", "another one", "one in each session")
        self._vertices = len(mesh.vertices)

    def _check(self, patch: Patch) -> None:
        """Check that the client requested a patch's law and has the vertices of a mesh patch."""
        if patch.law not in self._laws:
            asked = " or ".join(law.value for law in self._laws)
            raise RemoteProtocolError("law of a patch", patch.law.value, asked)
        if patch.neighbourhood is None:
            return
        if self._vertices is None:
            raise RemoteProtocolError("geometry of a patch", "mesh", "a rest mesh before it")
        last = max(patch.neighbourhood.indices, default=0)
        if last >= self._vertices:
            limit = f"less than the vertices of the rest mesh, {self._vertices}"
            raise RemoteProtocolError("index of a vertex", last, limit)


def _decode(frame: bytes) -> RestMesh | Patch:
    """Decode a binary message by its kind; an unknown kind raises the error of an invalid patch."""
    if len(frame) >= HEADER.size and frame[1] == FrameKind.REST_MESH:
        return RestMesh.decode(frame)
    return Patch.decode(frame)
