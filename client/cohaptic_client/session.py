"""The client's half of the protocol as a state machine without I/O."""

from __future__ import annotations

from enum import Enum

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.control import (
    Bye,
    Error,
    Hello,
    UserJoined,
    UserLeft,
    Welcome,
    decode_server_control,
    encode_control,
)
from cohaptic.protocol.patch import Patch


class State(Enum):
    """Where a session is in its life."""

    AWAIT_WELCOME = "waits for welcome"
    JOINED = "joined"
    CLOSED = "closed"


Event = Welcome | Patch | UserJoined | UserLeft | Error

ALLOWED: dict[State, tuple[type[Event], ...]] = {
    State.AWAIT_WELCOME: (Welcome, Error),
    State.JOINED: (Patch, UserJoined, UserLeft, Error),
    State.CLOSED: (),
}


class ClientSession:
    """One connection to a server, seen from the client.

    Attributes:
        state: Where the session is.
    """

    def __init__(self) -> None:
        self.state = State.AWAIT_WELCOME

    @staticmethod
    def greeting(hello: Hello) -> str:
        """First message of the connection."""
        return encode_control(hello)

    @staticmethod
    def farewell() -> str:
        """Last message of the connection."""
        return encode_control(Bye())

    def receive(self, data: str | bytes) -> Event:
        """Take one message from the server.

        Raises:
            RemoteProtocolError: The server broke the protocol; the session is over.
        """
        try:
            message = Patch.decode(data) if isinstance(data, bytes) else decode_server_control(data)
            if not isinstance(message, ALLOWED[self.state]):
                allowed = (
                    " or ".join(kind.__name__ for kind in ALLOWED[self.state]) or "nothing more"
                )
                what = type(message).__name__
                raise RemoteProtocolError("message", what, f"{allowed}: {self.state.value}")
        except RemoteProtocolError:
            self.state = State.CLOSED
            raise
        if isinstance(message, Welcome):
            self.state = State.JOINED
        elif isinstance(message, Error):
            self.state = State.CLOSED
        return message
