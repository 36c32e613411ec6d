"""Messages between processes as lines of JSON, each of which says its kind. No I/O."""

from __future__ import annotations

from typing import Generic, TypeVar

from pydantic import BaseModel, TypeAdapter, ValidationError

from cohaptic.errors import one_line

L = TypeVar("L", bound=BaseModel)


class BadLine(ValueError):
    """A line that is no message of its channel."""


class JsonLines(Generic[L]):
    """The messages of one channel.

    Args:
        kinds: All of them, told apart by a field.
    """

    def __init__(self, kinds: TypeAdapter[L]) -> None:
        self._kinds = kinds

    def encode(self, line: L) -> bytes:
        """As a line, with its end."""
        return line.model_dump_json().encode() + b"\n"

    def decode(self, data: bytes) -> L:
        """From a line.

        Raises:
            BadLine: It is none of these messages.
        """
        try:
            return self._kinds.validate_json(data)
        except ValidationError as error:
            raise BadLine(one_line(repr(data), 200)) from error
