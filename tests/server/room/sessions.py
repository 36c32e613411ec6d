"""Sessions in every state, and how they ended."""

from __future__ import annotations

from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.control.message import Named
from cohaptic.protocol.messages import (
    BodyInfo,
    Bye,
    Come,
    Error,
    Hello,
    Welcome,
    decode_server_control,
    encode_control,
)
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import Watch
from cohaptic_server.room.session import Event, ServerSession, State
from tests.server.peers import hello_text, sample

BODY = BodyInfo(name="balloon", center=(0.0, 0.0, 0.0), radius=0.1, contact_radius=0.02)


WELCOME = Welcome(user=1, name="left", simulation_period=0.02, body=BODY, users=())


ANSWER = Named(name="left")


def session_in(state: State) -> ServerSession:
    """A session that came to `state` by the ordinary way, at time 0."""
    session = ServerSession(0.0)
    if state is State.AWAIT_HELLO:
        return session
    first = MESSAGES[Watch] if state is State.WATCHES else hello_text()
    session.receive(first, 0.0)
    if state is State.QUEUED:
        session.queue()
    if state in (State.JOINED, State.CLOSED):
        session.accept(WELCOME)
    if state is State.CLOSED:
        session.receive(encode_control(Bye()), 0.0)
    session.events()
    session.outbox.take(clear=True)
    assert session.state is state
    return session


def ended(session: ServerSession) -> tuple[int, str]:
    """Code and reason of a session that is over."""
    assert session.state is State.CLOSED
    assert session.close is not None
    return session.close


def last_words(session: ServerSession) -> Error:
    """The error that a session has for its client; it must be the last that it has."""
    written = session.outbox.take(clear=True)
    assert isinstance(written[-1], str)
    error = decode_server_control(written[-1])
    assert isinstance(error, Error)
    return error


MESSAGES: dict[type[Event], str | bytes] = {
    Hello: hello_text(),
    ContactSample: sample().encode(),
    Bye: encode_control(Bye()),
    Come: encode_control(Come()),
    Watch: encode_control(Watch(protocol=PROTOCOL_VERSION)),
}
