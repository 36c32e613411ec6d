"""What outlives the process of a room: tokens for one time, and who was put out. No I/O.

All times are Unix times, since a monotonic clock begins anew with the machine.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

# 13 MB at the most. Only who has valid tokens can fill it, and when it is full nobody new comes in:
# to forget one that is still valid would let it be used again.
MOST_USED = 65_536
MOST_REMOVED = 256  # of whom the oldest is forgotten first; only an administrator adds to it
LONGEST = 4096  # characters of a line: the names of a token and a session are shorter

Time = Annotated[float, Field(allow_inf_nan=False)]
Short = Annotated[str, Field(max_length=300)]  # longer than any that a server makes


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Used(_Record):
    """A token for one time that was used.

    Args:
        jti: Its name.
        ends: When it is refused for its age in any case [s].
    """

    kind: Literal["used"] = "used"
    jti: Short
    ends: Time


class Removal(_Record):
    """Somebody who was put out.

    Args:
        session: Name of the session; empty for one without a token.
        invitation: Name of the invitation that it began with; empty for none.
        name: That it touched by.
        source: Whom its connection was counted with.
        at: When it was put out [s].
        until: When it may come back [s]; None for one who was banned.
    """

    kind: Literal["removed"] = "removed"
    session: Short
    invitation: Short
    name: Short
    source: Short
    at: Time
    until: Time | None

    def counts(self, wall: float) -> bool:
        """Whether it still keeps somebody out at a Unix time [s]."""
        return self.until is None or wall < self.until


class Pardon(_Record):
    """Whoever was put out by a name before may come back.

    Args:
        name: Name of a `Removal`.
        at: When it was said [s].
    """

    kind: Literal["pardoned"] = "pardoned"
    name: Short
    at: Time


Record = Used | Removal | Pardon
_RECORDS: TypeAdapter[Record] = TypeAdapter(Annotated[Record, Field(discriminator="kind")])


def encode(record: Record) -> bytes:
    """As a line, with its end."""
    return record.model_dump_json().encode() + b"\n"


def decode(line: bytes) -> Record | None:
    """From a line; None for what is none, such as one that was cut when a machine lost power."""
    if len(line) > LONGEST:
        return None
    try:
        return _RECORDS.validate_json(line)
    except ValidationError:
        return None


def still_counting(records: Iterable[Record], wall: float) -> list[Record]:
    """Those of them that say something at a Unix time [s], in order and bounded in number."""
    used: dict[str, Used] = {}
    removals: list[Removal] = []
    pardoned: set[str] = set()
    # Backwards: a pardon is of those who were put out before it, and is looked at once.
    for record in reversed(tuple(records)):
        if isinstance(record, Removal):
            if record.name not in pardoned:
                removals.append(record)
        elif isinstance(record, Pardon):
            pardoned.add(record.name)
        else:
            used.setdefault(record.jti, record)
    kept = [one for one in used.values() if wall < one.ends][:MOST_USED]
    keeping_out = [one for one in removals if one.counts(wall)][:MOST_REMOVED]
    return [*reversed(kept), *reversed(keeping_out)]
