"""Messages between processes as lines of JSON, each with a field for its kind. No I/O."""

from __future__ import annotations

from typing import Generic, TypeVar

from pydantic import BaseModel, TypeAdapter, ValidationError

from cohaptic.errors import one_line

L = TypeVar("L", bound=BaseModel)


class BadLine(ValueError):
    """Error: a line is not a message that its channel knows."""


class JsonLines(Generic[L]):
    """Encodes and decodes the messages of one channel.

    Args:
        kinds: Union type of all messages, which a field `kind` distinguishes.
    """

    def __init__(self, kinds: TypeAdapter[L]) -> None:
        self._kinds = kinds

    def encode(self, line: L) -> bytes:
        """Return a message as a line of JSON, with the newline."""
        return line.model_dump_json().encode() + b"\n"

    def decode(self, data: bytes) -> L:
        """Return the message in a line of JSON.

        Raises:
            BadLine: The line is not a message of this channel.
        """
        try:
            return self._kinds.validate_json(data)
        except ValidationError as error:
            raise BadLine(one_line(repr(data), 200)) from error
