"""Control messages: their base classes, the capabilities of a device, and the names of clients.

The base classes make messages frozen and bounded, without empty optional fields. A hello carries
the capabilities of the client's device. A client can change its name while it touches or waits for
a seat.

Names that people choose are tidied, and names with invisible characters are refused. Compatibility
forms (NFKC: full width, ligatures, other blanks) become plain letters. Blanks at the ends, repeated
blanks and variation selectors, which choose a form of the letter before, are dropped.
"""

from __future__ import annotations

import unicodedata
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
)

SECRETS = ("key", "token", "session")  # fields that no error and no log may quote
_SELDOM_SAID = (*SECRETS, "wait", "capabilities", "company", "models", "rules")

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


# As names of columns in a recording.
RuleName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,30}$")]


class LoopRules(ControlMessage):
    """Difference of a client's haptic loop from the rules of this version; only shown to people.

    Args:
        added: Names of rules of other packages, in the order in which they act.
        lacking: Names of rules that the loop does not have.
    """

    added: Annotated[tuple[RuleName, ...], Field(max_length=4)] = ()
    lacking: Annotated[tuple[RuleName, ...], Field(max_length=16)] = ()


class Capabilities(ControlMessage):
    """Capabilities of a device, in the spirit of the device metadata of IEEE 1918.1.1.

    Conformance with that standard is not claimed. A server only shows the capabilities to people;
    the values that the loop needs are fields of the hello itself.

    Args:
        device: Name of the kind of device.
        sensed_axes: Number of translational degrees of freedom that the device senses.
        force_axes: Number of axes along which the device gives force; 0 if it only senses.
        max_force: Largest force for a short time; 0 if the device only senses [N].
        max_stiffness: Largest stiffness that the device renders stably [N/m].
        damping: Physical damping of the device itself [N s/m].
        max_damping: Largest damping that the device renders stably; 0 if not measured [N s/m].
        resolution: Smallest step of position that the device resolves; 0 if unknown [m].
        rate: Highest rate at which the device reports positions and takes forces [Hz].
    """

    device: Name
    sensed_axes: int = Field(default=3, ge=0, le=3)
    force_axes: int = Field(default=3, ge=0, le=3)
    max_force: float = Field(default=0.0, ge=0.0, le=1000.0)
    max_stiffness: float = Field(default=0.0, ge=0.0, le=1e6)
    damping: float = Field(default=0.0, ge=0.0, le=1000.0)
    max_damping: float = Field(default=0.0, ge=0.0, le=1000.0)
    resolution: float = Field(default=0.0, ge=0.0, le=1.0)
    rate: float = Field(default=1000.0, gt=0.0, le=1e5)


class SetName(ControlMessage):
    """Ask for another name from now on, without leaving; the server answers with `named`.

    Args:
        name: As in a hello.
    """

    type: Literal["set_name"] = "set_name"
    name: ChosenName


class Named(ControlMessage):
    """The answer to `set_name`: the present name of the client.

    Args:
        name: Name that the client asked for; the previous name if that one is not available.
        reason: Why the name is not available, in one sentence; empty if the client got that name.
    """

    type: Literal["named"] = "named"
    name: Name
    reason: str = ""


# Direction marks, joiners, zero-width blanks and private use: such characters are invisible, or
# look different to each reader. Characters that this Python does not know yet may be new letters,
# and pass.
_UNSEEN_KINDS = ("Cc", "Cf", "Co", "Cs", "Zl", "Zp")
# Letters and marks that are drawn as nothing (Default_Ignorable_Code_Point of Unicode, beyond the
# kinds above), the Braille cell without dots, and a filler and a note that are not drawn.
_UNSEEN = frozenset(
    "\u034f\u115f\u1160\u17b4\u17b5\u180b\u180c\u180d\u180f\u2065\u2800\u3164\uffa0"
    "\ufff0\ufff1\ufff2\ufff3\ufff4\ufff5\ufff6\ufff7\ufff8\U00016fe4\U0001d159"
)
_PLANE_OF_TAGS = range(0xE0000, 0xE1000)


def tidy_name(name: str) -> str:
    """The name in the form that a server accepts; raises ValueError if the name is not allowed."""
    plain = "".join(c for c in unicodedata.normalize("NFKC", name) if not _selects_a_form(c))
    for c in plain:
        if unicodedata.category(c) in _UNSEEN_KINDS or c in _UNSEEN or ord(c) in _PLANE_OF_TAGS:
            raise ValueError(f"a name has no character that is not seen, as U+{ord(c):04X} is not")
    tidy = " ".join(plain.split())
    if not 1 <= len(tidy) <= MAX_NAME:
        limit = f"without blanks at its ends a name has 1 to {MAX_NAME} characters"
        raise ValueError(f"{limit}, and this one {len(tidy)}")
    return tidy


def _selects_a_form(c: str) -> bool:
    return "\ufe00" <= c <= "\ufe0f" or "\U000e0100" <= c <= "\U000e01ef"


ChosenName = Annotated[Name, AfterValidator(tidy_name)]
