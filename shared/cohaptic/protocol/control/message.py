"""Base classes of control messages: frozen, bounded, and without empty optional fields."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
)

SECRETS = ("key", "token", "session")  # fields that no error and no log may quote
_SELDOM_SAID = (*SECRETS, "wait", "capabilities", "company")

MAX_NAME = 32  # characters
# Names are printable and of one line, since terminals and pages show them.
Name = Annotated[
    str, Field(min_length=1, max_length=MAX_NAME, pattern=r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029]+$")
]


class ControlMessage(BaseModel):
    """Base of all control messages: frozen, without unknown fields and without infinities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class WithSecrets(ControlMessage):
    """A message whose secrets and seldom used fields are left off the wire when empty or false."""

    @model_serializer(mode="wrap")
    def _without_what_is_not_said(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        fields: dict[str, Any] = handler(self)
        return {name: value for name, value in fields.items() if name not in _SELDOM_SAID or value}
