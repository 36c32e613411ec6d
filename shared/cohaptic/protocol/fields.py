"""What the table of binary frames is made of: fields in a row, and the frame in which they stand.

The haptic loop's process imports this module, so it needs neither numpy nor pydantic.
"""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import Final, NamedTuple

# Types of a field with the letter that `struct` has for each; padding is sent as zeros.
CODES: Final = {
    "u8": "B", "u16": "H", "u32": "I", "i16": "h", "f16": "e", "f32": "f", "f64": "d", "pad": "x",
}  # fmt: skip


class FrameKind(IntEnum):
    """Second byte of every binary frame."""

    CONTACT_SAMPLE = 1
    PATCH = 2
    REST_MESH = 3
    SCENE = 4
    ACK = 5
    ROWS = 6


class Field(NamedTuple):
    """Numbers of one type behind each other, which have one name.

    Fields:
        name: Name in the docs and in both languages.
        type: A key of `CODES`.
        numbers: How many of them; 3 f32 make a vector.
        unit: Unit for the docs; empty for a count or a number of something.
        meaning: Meaning for the docs, in Markdown.
        limit: Values that a decoder accepts, for the docs; empty for all values of the type.
        group: Name of the value that this field and its neighbours make together; empty for none.
    """

    name: str
    type: str
    numbers: int = 1
    unit: str = ""
    meaning: str = ""
    limit: str = ""
    group: str = ""

    @property
    def code(self) -> str:
        """The letters of `struct` for this field, such as `3f`."""
        return f"{self.numbers if self.numbers > 1 else ''}{CODES[self.type]}"

    @property
    def size(self) -> int:
        """Length [B]."""
        return self.numbers * self.step

    @property
    def step(self) -> int:
        """Length of one number [B]."""
        return struct.calcsize(f"<{CODES[self.type]}")


class Frame(NamedTuple):
    """What the header of a frame says, and in which direction the frame goes.

    Fields:
        kind: Second byte of the header.
        direction: Sender and receiver, for the docs.
        flags: Meaning of the header's flags, for the docs.
        limit: Values of the flags that a decoder accepts, for the docs.
    """

    kind: FrameKind
    direction: str
    flags: str
    limit: str = ""


class Layout(NamedTuple):
    """Fields without gaps between them: those of a frame behind its header, or of a part.

    Fields:
        name: Name in the docs and in both languages.
        meaning: One sentence for the docs, in Markdown.
        fields: All fields, in their order on the wire.
        frame: What the header says; None for a part, which stands inside a frame.
    """

    name: str
    meaning: str
    fields: tuple[Field, ...]
    frame: Frame | None = None

    @property
    def codes(self) -> str:
        """The letters of `struct` for all fields, without the byte order."""
        return "".join(field.code for field in self.fields)

    def packer(self) -> struct.Struct:
        """What packs and unpacks the fields; a frame's header is not among them."""
        return struct.Struct(f"<{self.codes}")

    @property
    def size(self) -> int:
        """Length with a frame's header, and without the parts that may follow [B]."""
        return sum(field.size for field in self.all_fields)

    @property
    def all_fields(self) -> tuple[Field, ...]:
        """All fields, those of a frame's header included."""
        return self.fields if self.frame is None else HEAD.fields + self.fields

    @property
    def offsets(self) -> tuple[int, ...]:
        """Where each of `all_fields` begins [B]."""
        sizes = [field.size for field in self.all_fields]
        return tuple(sum(sizes[:k]) for k in range(len(sizes)))


HEAD: Final = Layout(
    "head",
    "The beginning of every frame.",
    (Field("version", "u8"), Field("kind", "u8"), Field("flags", "u16")),
)
