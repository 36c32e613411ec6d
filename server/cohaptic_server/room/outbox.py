"""Queue of messages to one peer: events in order, the newest state, and the newest patch.

A new patch replaces a patch that was not sent yet, so that a client that cannot keep up gets fewer
patches but no outdated ones. Events (such as a welcome message or an error) are never dropped; if
more than `MAX_EVENTS` events would wait, the client is disconnected and told why.

Messages about other users are state and not events; otherwise those users could fill the queue and
so disconnect this client. If a user came and left while nothing could be written, the client is
told neither. For each other user, at most one message of each kind waits. So the number of users
who are or were in the room bounds the waiting state.
"""

from __future__ import annotations

from cohaptic.protocol.control.message import ControlMessage
from cohaptic.protocol.messages import (
    Place,
    Recorded,
    Restraints,
    UserJoined,
    UserLeft,
    Welcome,
    encode_control,
)
from cohaptic.protocol.watch_messages import PutOut, Watching

MAX_EVENTS = 64
_STATE = (
    UserJoined,
    UserLeft,
    Restraints,
    Recorded,
    PutOut,
    Place,
)  # only the newest message waits


class Outbox:
    """Messages that wait for a peer: at most `MAX_EVENTS` events, the newest state, and one patch.

    Attributes:
        patches_skipped: Number of patches that were replaced before they were sent.
    """

    def __init__(self) -> None:
        self._waiting: dict[object, str | bytes] = {}  # in order; the key of an event is a number
        self._events = 0
        self._newest_user = 0  # highest number in messages sent or waiting; numbers rise
        self._unknown: set[int] = set()  # users whose joining the client was not told yet
        self._patch: bytes | None = None
        self.patches_skipped = 0

    @property
    def empty(self) -> bool:
        """Whether no message waits."""
        return self._patch is None and not self._waiting

    def put(self, message: ControlMessage) -> bool:
        """Queue a message; return False if it is an event and the queue of events is full."""
        if isinstance(message, Welcome):
            self._newest_user = message.user
        elif isinstance(message, Watching):
            self._newest_user = max((user.user for user in message.users), default=0)
        if not isinstance(message, _STATE):
            return self.put_event(encode_control(message))
        user = message.user if isinstance(message, UserJoined | UserLeft) else 0
        if isinstance(message, UserJoined) and user > self._newest_user:
            self._newest_user = user
            self._unknown.add(user)
        elif isinstance(message, UserLeft) and user in self._unknown:
            self._unknown.discard(user)
            del self._waiting[UserJoined, user]
            return True
        key = (type(message), user)
        self._waiting.pop(key, None)  # moves to the end, since the newest news determine the order
        self._waiting[key] = encode_control(message)
        return True

    def put_event(self, data: str | bytes) -> bool:
        """Queue an event: a text, or a frame that no later frame replaces (the mesh at rest).

        Returns:
            Whether the queue had room for the event; the caller ends the session if not.
        """
        if self._events >= MAX_EVENTS:
            return False
        self._waiting[self._events] = data
        self._events += 1
        return True

    def put_patch(self, frame: bytes) -> None:
        """Queue a patch; it replaces a patch that still waits."""
        if self._patch is not None:
            self.patches_skipped += 1
        self._patch = frame

    def take(self, *, clear: bool) -> list[str | bytes]:
        """Remove and return the messages to write now: events and state, then the patch.

        Args:
            clear: Whether the operating system has taken all earlier writes. If not, the list is
                empty, and newer messages can still replace waiting ones.
        """
        if not clear:
            return []
        messages: list[str | bytes] = []
        if self._waiting:
            messages += self._waiting.values()
            self._waiting.clear()
            self._unknown.clear()
            self._events = 0
        if self._patch is not None:
            messages.append(self._patch)
            self._patch = None
        return messages
