"""The exceptions of cohaptic, as a tree.

    CohapticError                  base of every exception that cohaptic raises on purpose
        SettingError               a value given by the user is outside its limits
        ProtocolError              a message broke the rules
            LocalProtocolError     our message broke the rules: a bug on this side
            RemoteProtocolError    the peer's message broke the rules: only its session ends
        DeviceError                a haptic device cannot be opened, read or written
        ServerLost                 the server cannot be reached, or went away
            ServerUnreachable      the server cannot be reached, and no further attempt will help
        AnotherObject              the server no longer has the object that the client touched
        BodyError                  an elastic body cannot be built or solved
            HeldError              too few or too many vertices of a body are fixed
        OutputError                a file of results cannot be written to the end
        LinkOverflow               a simulated link would hold more messages than its limit

Each exception stores its values in fields and makes its sentence from these, so that a log can
count exceptions by their fields and a person can read the sentence.
"""

from __future__ import annotations

import re
from enum import Enum


class CloseCode(Enum):
    """WebSocket close codes of cohaptic, in the range that RFC 6455 leaves to applications."""

    BAD_MESSAGE = 4400
    UNAUTHENTICATED = 4401
    FORBIDDEN = 4403
    NO_ROOM = 4404
    HELLO_TIMEOUT = 4408
    NAME_TAKEN = 4409
    OBJECT_CHANGED = 4410
    UPLOAD_FAILED = 4422
    WRONG_VERSION = 4426
    ROOM_FULL = 4429
    TOO_SLOW = 4430
    TOO_MANY = 4431
    SERVER_STOPS = 4503


class CohapticError(Exception):
    """Base of every exception that cohaptic raises on purpose."""


class SettingError(CohapticError):
    """A value given by the user is outside its limits.

    Args:
        name: Name of the value, as the user knows it.
        limit: Phrase that completes the sentence "it must be ...".
    """

    def __init__(self, name: str, value: object, limit: str) -> None:
        super().__init__(name, value, limit)
        self.name = name
        self.value = value
        self.limit = limit

    def __str__(self) -> str:
        given = "empty" if self.value == "" else self.value
        return f"{self.name} is {given}; it must be {self.limit}"


class ProtocolError(CohapticError):
    """A message broke the rules of `docs/protocol.md`.

    Args:
        subject: The message or field at fault, in words.
        value: Value as received.
        limit: Values that would have been valid.
        code: Code with which the connection is closed.
        field: The same as `subject` for programs, such as `seq`; by default made of its words up to
            the first "of".
    """

    def __init__(
        self,
        subject: str,
        value: object,
        limit: str,
        code: CloseCode = CloseCode.BAD_MESSAGE,
        field: str = "",
    ) -> None:
        super().__init__(subject, value, limit, code, field)
        self.field = field or subject.partition(" of ")[0].replace(" ", "_")
        self.subject = subject
        self.value = value
        self.limit = limit
        self.code = code

    def __str__(self) -> str:
        return f"{self.subject} is {_short(self.value)}; expected {self.limit}"


class LocalProtocolError(ProtocolError):
    """A message that this side was about to send breaks the protocol: a bug on this side."""


class RemoteProtocolError(ProtocolError):
    """A message that the peer sent breaks the protocol; only the peer's session ends."""


class DeviceError(CohapticError):
    """A haptic device cannot be opened, read or written.

    Args:
        problem: Phrase that says what happened.
        advice: Phrase that says what the user can do; empty for none.
    """

    def __init__(self, device: str, problem: str, advice: str = "") -> None:
        super().__init__(device, problem, advice)
        self.device = device
        self.problem = problem
        self.advice = advice

    def __str__(self) -> str:
        return f"{self.device}: {self.problem}" + (f"; {self.advice}" if self.advice else "")


class ServerLost(CohapticError):
    """The server cannot be reached, or went away."""

    def __init__(self, url: str, problem: str) -> None:
        super().__init__(url, problem)
        self.url = url
        self.problem = problem

    def __str__(self) -> str:
        return f"{self.url}: {self.problem}"


class ServerUnreachable(ServerLost):
    """No further attempt will reach the server: its address or its certificate is not valid."""


class AnotherObject(CohapticError):
    """The server no longer has the object that the client touched."""

    def __str__(self) -> str:
        return "the server has another object now"


class BodyError(CohapticError):
    """An elastic body cannot be built or solved."""


class HeldError(BodyError):
    """So few vertices of a body are fixed that it could move as a whole, or all are fixed."""


class OutputError(CohapticError):
    """A file of results or a recording cannot be written, or not to its end.

    Args:
        path: Path of the file.
        problem: Phrase that says what happened.
        kept: Sentence that says where what there is can be found; empty for nowhere.
    """

    def __init__(self, path: object, problem: str, kept: str = "") -> None:
        super().__init__(path, problem, kept)
        self.path = path
        self.problem = problem
        self.kept = kept

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}" + (f"; {self.kept}" if self.kept else "")


class LinkOverflow(CohapticError):
    """A simulated link would hold more messages in flight than its limit."""

    def __init__(self, capacity: int) -> None:
        super().__init__(capacity)
        self.capacity = capacity

    def __str__(self) -> str:
        return f"the simulated link is full: {self.capacity} messages are in flight, the limit"


# Every token begins with the base64url of `{"`. No text that quotes a peer may reveal a token.
_LONGEST_TOKEN = 2048  # characters
_TOKEN = re.compile(r"eyJ[A-Za-z0-9_=-]{8,}(\.[A-Za-z0-9_=-]*)*")


def one_line(text: str, limit: int = 120) -> str:
    """Return a peer's text as one printable line for terminals and logs, without access tokens.

    Args:
        limit: Length beyond which the text is cut and "..." appended [characters].
    """
    text = _TOKEN.sub("(a token)", text[: 2 * limit + _LONGEST_TOKEN])
    line = "".join(c if c.isprintable() else "?" for c in text[: limit + 1])
    return line if len(line) <= limit else line[:limit] + "..."


def _short(value: object) -> str:
    return one_line(repr(value), 60)
