"""The life of a participant, from the connection to the last trace: one table of states and steps.

The table is the program: a session changes its state by `after` alone, takes the messages of
`MESSAGES` alone, and `docs/protocol.md` prints and draws the table (`make life`). Each step names
the function that decides it; whoever changes who may take a kept seat finds that function there.

What the hand of a participant who touches does is a second, independent state: `hand_of`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from cohaptic.errors import CloseCode
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.control.message import SetName
from cohaptic.protocol.messages import Bye, Come, Hello, Mark, SetLaw
from cohaptic.protocol.watch_messages import Watch

# s for the first message. A client sends it at once; a path that holds it up for longer is lost.
HELLO_TIMEOUT = 5.0
# s without a sample, after which a user's force fades until the next one. Reasoned, not measured:
# tens of simulation periods, so that a hiccup of the link changes nothing, and no more, since the
# last force of a lost connection must not stay.
STALE_AFTER = 0.5

Message = Hello | Watch | Come | SetName | SetLaw | Mark | ContactSample | Bye


class State(Enum):
    """State of a participant; the values complete the sentence "the participant ..."."""

    OFFERED = "has not said hello"
    ASKING = "waits for the answer to its hello"
    WAITING = "waits for a seat"
    CALLED = "is called to a seat"
    JOINED = "touches"
    WATCHING = "watches"
    KEPT = "has lost its connection, and its place is kept"
    GONE = "is gone"


class Event(Enum):
    """Event that changes the state; the values complete the sentence "the participant ..."."""

    ASKS = "sends its first message"
    SILENT = "sends no first message in time"
    SEATED = "gets a seat"
    QUEUED = "finds the room full"
    ADMITTED = "may watch"
    CALLED = "is called"
    COMES = "follows the call"
    MISSED = "misses the call"
    LEAVES = "leaves"
    REFUSED = "is refused or put out"
    REPLACED = "comes with another connection"
    LOST = "loses its connection"
    RETURNS = "comes back"
    EXPIRED = "does not come back in time"


@dataclass(frozen=True, slots=True)
class Step:
    """Row of the table.

    Args:
        before: States in which the event may happen.
        after: State that follows.
        rule: Sentence that says when the event happens.
        where: Functions that decide it, as `module:name` below `cohaptic_server.room`.
    """

    before: tuple[State, ...]
    event: Event
    after: State
    rule: str
    where: str


_CONNECTED = (State.OFFERED, State.ASKING, State.WAITING, State.CALLED, State.WATCHING)

LIFE = (
    Step((State.OFFERED,), Event.ASKS, State.ASKING,
         "Its first message is a `hello`, to touch, or a `watch`, to watch.",
         "session:ServerSession.receive"),
    Step((State.OFFERED,), Event.SILENT, State.GONE,
         f"No first message has come within {HELLO_TIMEOUT:g} s.",
         "session:ServerSession.handle_timer"),
    Step((State.ASKING,), Event.SEATED, State.JOINED,
         "Token, name and wishes are accepted, and a seat is free, or kept for this participant.",
         "room:Room.join"),
    Step((State.ASKING,), Event.QUEUED, State.WAITING,
         "No seat is free, the hello said `wait`, and the queue has a place.",
         "seats.wait_queue:WaitQueue.enter"),
    Step((State.ASKING,), Event.ADMITTED, State.WATCHING,
         "Its token allows watching, and the room has a seat for a watcher.",
         "watch.scene_broadcast:SceneBroadcast.enter"),
    Step((State.WAITING,), Event.CALLED, State.CALLED,
         "A seat is free, and nobody in the queue came earlier.",
         "seats.wait_queue:WaitQueue.call"),
    Step((State.CALLED,), Event.COMES, State.ASKING,
         "It answers `come`; token and name are checked again.",
         "session_setup:SessionSetup.come"),
    Step((State.CALLED,), Event.MISSED, State.GONE,
         "It has not answered in time: the seat goes to the next in the queue.",
         "seats.wait_queue:WaitQueue.late"),
    Step((State.JOINED,), Event.LOST, State.KEPT,
         "The connection broke, or the server closed it without a fault of the client: name and "
         "seat are kept for a while.",
         "session_host:SessionHost.disconnect"),
    Step((State.KEPT,), Event.RETURNS, State.JOINED,
         "A hello has the key or the session of the lost client, or asks for exactly the kept name "
         "from the same address.",
         "seats.names:may_take_kept"),
    Step((State.KEPT,), Event.EXPIRED, State.GONE,
         "The seat is kept for 15 s, the name for 60 s.",
         "seats.names:KeptNames.keep"),
    Step((State.WAITING, State.CALLED, State.JOINED), Event.REPLACED, State.GONE,
         "Another connection has the same key or session, or the same name and address after a "
         "silence: it has the seat, or the place in the queue, from now on.",
         "seats.names:may_replace"),
    Step(_CONNECTED, Event.LOST, State.GONE,
         "The connection broke; there is no name and no seat to be kept.",
         "session_host:SessionHost.disconnect"),
    Step((*_CONNECTED, State.JOINED, State.KEPT), Event.LEAVES, State.GONE,
         "It says `bye`, or closes the connection with a reason.",
         "session_host:SessionHost.disconnect"),
    Step((*_CONNECTED, State.JOINED), Event.REFUSED, State.GONE,
         "First: rate limit, token and removals; then its name (taken, kept, or of one who "
         "waits), its wishes and the seats. Later: a message broke the protocol, its token has "
         "expired, or an administrator has put it out.",
         "session_setup:RoomAdmission.enter room:Room.join seats.names:KeptNames.check "
         "seats.waiting:Waiting.check_name session:ServerSession.fail moderation:moderate"),
)  # fmt: skip

# What a client may send in each state, in an order that its user reads; the rest is refused.
MESSAGES: dict[State, tuple[type[Message], ...]] = {
    State.OFFERED: (Hello, Watch),
    State.WAITING: (SetName, Bye),
    State.CALLED: (Come, SetName, Bye),
    State.JOINED: (ContactSample, SetName, SetLaw, Mark, Bye),
}
_AFTER = {(before, step.event): step.after for step in LIFE for before in step.before}


def after(state: State, event: Event) -> State:
    """Return the state that follows an event.

    Raises:
        ValueError: The event cannot happen in this state, which is a fault of the server.
    """
    if (state, event) not in _AFTER:
        raise ValueError(f"a participant that {state.value} cannot be one that {event.value}")
    return _AFTER[state, event]


# Close codes of connections that end without a fault of the client: the path or the machine was
# slow, the object changed, or the server stops.
_NO_FAULT = {CloseCode.TOO_SLOW, CloseCode.OBJECT_CHANGED, CloseCode.SERVER_STOPS}


def closed_by_server(code: CloseCode) -> Event:
    """Return the event that the server's closing of a connection is for the participant."""
    return Event.LOST if code in _NO_FAULT else Event.REFUSED


class Hand(Enum):
    """State of the hand of a participant who touches: why its force acts on the body, or fades."""

    ACTS = "acts on the body"
    SILENT = "fades: no sample has come lately"
    MUTED = "fades: an administrator has muted the user"
    FROZEN = "fades: an administrator has frozen the body, or the body begins anew"


def hand_of(*, frozen: bool, muted: bool, silence: float) -> Hand:
    """Return the state of a hand; of several reasons, the one that concerns the most people.

    Args:
        frozen: Whether the body takes no forces at present.
        muted: Whether an administrator has muted the user.
        silence: Time since the user's last sample [s].
    """
    if frozen:
        return Hand.FROZEN
    if muted:
        return Hand.MUTED
    return Hand.SILENT if silence > STALE_AFTER else Hand.ACTS
