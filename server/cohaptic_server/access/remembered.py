"""Records that outlive the process of a room: used tokens, removals and pardons. No I/O.

All times are Unix times, since a monotonic clock restarts with the machine.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

# Used tokens that are remembered, 13 MB at most. Only owners of valid tokens can fill this memory.
# When it is full, nobody comes in with a new token, because a used token that was forgotten could
# be used again.
MAX_USED = 65_536
MAX_REMOVED = 256  # the oldest removal is dropped first; only an administrator adds removals
LONGEST = 4096  # characters of a line: the names of a token and a session are shorter

Time = Annotated[float, Field(allow_inf_nan=False)]
Short = Annotated[str, Field(max_length=300)]  # longer than any text that a server makes


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Used(_Record):
    """Record that a single-use token was used.

    Args:
        jti: Name of the token.
        ends: Time from which the token is refused as expired [s].
    """

    kind: Literal["used"] = "used"
    jti: Short
    ends: Time


class Removal(_Record):
    """Record that an administrator has put a user out of the room.

    Args:
        session: Name of the user's session; empty for a user without a token.
        invitation: Name of the invitation that began the session; empty without a token.
        name: Name of the user in the room.
        source: Source (address or network) whose budgets the user's connection spent.
        at: Time at which the user was put out [s].
        until: Time from which the user may come back [s]; None for a banned user.
    """

    kind: Literal["removed"] = "removed"
    session: Short
    invitation: Short
    name: Short
    source: Short
    at: Time
    until: Time | None

    def counts(self, wall: float) -> bool:
        """Check whether the removal still keeps the user out at the Unix time `wall` [s]."""
        return self.until is None or wall < self.until


class Pardon(_Record):
    """Record that all users who were put out under one name before may come back.

    Args:
        name: Name of these users, as in `Removal`.
        at: Time of the pardon [s].
    """

    kind: Literal["pardoned"] = "pardoned"
    name: Short
    at: Time


Record = Used | Removal | Pardon
_RECORDS: TypeAdapter[Record] = TypeAdapter(Annotated[Record, Field(discriminator="kind")])


def encode(record: Record) -> bytes:
    """Return the line of a record in the journal, including the end of line."""
    return record.model_dump_json().encode() + b"\n"


def decode(line: bytes) -> Record | None:
    """Return the record in a line; None if it is invalid, such as cut off by a power failure."""
    if len(line) > LONGEST:
        return None
    try:
        return _RECORDS.validate_json(line)
    except ValidationError:
        return None


def still_counting(records: Iterable[Record], wall: float) -> list[Record]:
    """Return the records that still have an effect at the Unix time `wall` [s].

    Used tokens come first, then removals, each in the order of `records`. If there are more than
    `MAX_USED` or `MAX_REMOVED`, the newest are returned.
    """
    used: dict[str, Used] = {}
    removals: list[Removal] = []
    pardoned: set[str] = set()
    # Backwards, since a pardon applies to earlier removals, and so one pass is enough.
    for record in reversed(tuple(records)):
        if isinstance(record, Removal):
            if record.name not in pardoned:
                removals.append(record)
        elif isinstance(record, Pardon):
            pardoned.add(record.name)
        else:
            used.setdefault(record.jti, record)
    kept = [one for one in used.values() if wall < one.ends][:MAX_USED]
    keeping_out = [one for one in removals if one.counts(wall)][:MAX_REMOVED]
    return [*reversed(kept), *reversed(keeping_out)]
