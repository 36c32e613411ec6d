"""Sessions in every state, and how they ended."""

from __future__ import annotations

from cohaptic.errors import CloseCode
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.control.message import Named
from cohaptic.protocol.messages import (
    BodyInfo,
    Bye,
    Called,
    Come,
    Error,
    Hello,
    Welcome,
    decode_server_control,
    encode_control,
)
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import Watch
from cohaptic_server.room.life import Message, State
from cohaptic_server.room.session import ServerSession
from tests.server.peers import hello_text, sample

BODY = BodyInfo(name="balloon", center=(0.0, 0.0, 0.0), radius=0.1, contact_radius=0.02)


WELCOME = Welcome(user=1, name="left", simulation_period=0.02, body=BODY, users=())


ANSWER = Named(name="left")


# A client that watches goes on with another session.
STATES = [state for state in State if state is not State.WATCHING]


def session_in(state: State) -> ServerSession:
    """A session that came to `state` by the ordinary way, at time 0."""
    session = ServerSession(0.0)
    if state is State.OFFERED:
        return session
    session.receive(hello_text(), 0.0)
    if state in (State.WAITING, State.CALLED):
        session.queue()
    if state is State.CALLED:
        session.call(Called(within=5.0))
    if state in (State.JOINED, State.KEPT, State.GONE):
        session.accept(WELCOME)
    if state is State.GONE:
        session.receive(encode_control(Bye()), 0.0)
    if state is State.KEPT:
        session.stop(CloseCode.SERVER_STOPS, "the server stops")
    session.events()
    session.outbox.take(clear=True)
    assert session.state is state
    return session


def ended(session: ServerSession) -> tuple[int, str]:
    """Code and reason of a session that is over."""
    assert session.state in (State.KEPT, State.GONE)
    assert session.close is not None
    return session.close


def last_words(session: ServerSession) -> Error:
    """The error that a session has for its client; it must be the last that it has."""
    written = session.outbox.take(clear=True)
    assert isinstance(written[-1], str)
    error = decode_server_control(written[-1])
    assert isinstance(error, Error)
    return error


MESSAGES: dict[type[Message], str | bytes] = {
    Hello: hello_text(),
    ContactSample: sample().encode(),
    Bye: encode_control(Bye()),
    Come: encode_control(Come()),
    Watch: encode_control(Watch(protocol=PROTOCOL_VERSION)),
}
