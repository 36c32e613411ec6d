"""What a session consists of: frozen entries, each with its time on the server's clock.

The inputs of a room are kept in the order in which it took them, so that a replay can feed them to
the same world again; the outputs show what the world made of them; the clients' rows say what each
hand felt. A deformation is kept as the forces that cause it, not as vertices.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

Json = Mapping[str, Any]  # An object that JSON can represent.

# Bytes of the longest block or frame of an entry: a mesh of 65,535 vertices has 1.6 MB, a minute of
# one user's rows 24 MB, which comes in blocks of a tenth of a second.
LARGEST = 4 * 1024 * 1024
# s; a server's clock counts from its start, or from that of its machine.
MAX_TIME = 1e9


@dataclass(frozen=True, slots=True)
class SessionInfo:
    """What holds for a whole session; always the first entry.

    Args:
        t: Time at which the recording began [s].
        version: Version of cohaptic that wrote the file.
        protocol: Version of the wire protocol, for the frames in the file.
        room: Name of the room.
        body: `BodyInfo` of the object as JSON.
        simulation_period: Time between ticks [s].
        to_wall: Unix time less the server's clock [s].
        settings: What is needed to build the body and the room again, as JSON, without secrets.
    """

    t: float
    version: str
    protocol: int
    room: str
    body: Json
    simulation_period: float
    to_wall: float
    settings: Json


@dataclass(frozen=True, slots=True)
class Joined:
    """Input: a user joined.

    Args:
        t: Time [s].
        user: Number of the user.
        name: Name of the user.
        hello: The hello as JSON; its secrets are left out of the file.
        max_force: Largest force that the room takes from this user [N].
        source: Network address of the user; empty where the server keeps none.
    """

    t: float
    user: int
    name: str
    hello: Json
    max_force: float
    source: str = ""


@dataclass(frozen=True, slots=True)
class Left:
    """Input: a user left, at a time [s], for a reason in words."""

    t: float
    user: int
    reason: str


@dataclass(frozen=True, slots=True)
class LawSet:
    """Input: a user changed its law at a time [s]; `change` is its `SetLaw` as JSON."""

    t: float
    user: int
    change: Json


@dataclass(frozen=True, slots=True)
class Heard:
    """Input: the room took a contact sample of a user at a time [s]; `frame` has its bytes."""

    t: float
    user: int
    frame: bytes


@dataclass(frozen=True, slots=True)
class Ticked:
    """Input: the room advanced to a tick at a time [s]."""

    t: float
    tick: int


@dataclass(frozen=True, slots=True)
class PassedOver:
    """Input: the room at rest only counted some ticks at a time [s]."""

    t: float
    ticks: int


@dataclass(frozen=True, slots=True)
class Restrained:
    """Input: from a time [s] on the body is frozen or not, and these users are muted."""

    t: float
    frozen: bool
    muted: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class BudgetSet:
    """Input: from a time [s] on the forces of all users have a limit [N]; None for no limit."""

    t: float
    force: float | None


@dataclass(frozen=True, slots=True)
class BodyReset:
    """Input: at a time [s] the room was told to bring the body back to its initial state."""

    t: float


@dataclass(frozen=True, slots=True)
class Asked:
    """Input: at a time [s] the server asked for the columns that the body lacked."""

    t: float


@dataclass(frozen=True, slots=True)
class Solved:
    """Input: at a time [s] the columns came for which the last `Asked` asked."""

    t: float


@dataclass(frozen=True, slots=True)
class Patched:
    """Output: a patch for a user.

    Args:
        t: Time of the tick [s].
        tick: Number of the tick.
        user: Number of the user.
        frame: Bytes of the patch, as in `docs/protocol.md`.
    """

    t: float
    tick: int
    user: int
    frame: bytes


@dataclass(frozen=True, slots=True)
class Mesh:
    """Output: the resting surface, as the frame of a `RestMesh` or of a `QuantisedMesh`."""

    t: float
    frame: bytes


@dataclass(frozen=True, slots=True)
class Shown:
    """Output: the contacts of all users at a tick, from which the deformation follows.

    Args:
        t: Time of the tick [s].
        tick: Number of the tick.
        frame: Bytes of the scene, as in `docs/protocol.md`; with its surface now and then for a
            body whose deformation does not follow from the forces of the moment.
    """

    t: float
    tick: int
    frame: bytes


@dataclass(frozen=True, slots=True)
class Rows:
    """Rows of a client at the full rate of its loop.

    Args:
        t: Time of the first row on the server's clock [s].
        user: Number of the user.
        columns: Names of the columns; the first is `t`, the time on the client's clock.
        block: Rows of 64-bit little-endian numbers, one behind the other. The file keeps times,
            ticks and flags as they are, and the others as 32-bit numbers: to 6e-8 of the value.
        to_server: The server's clock less the client's [s].
        error: Bound on the error of `to_server` [s].
    """

    t: float
    user: int
    columns: tuple[str, ...]
    block: bytes
    to_server: float
    error: float


@dataclass(frozen=True, slots=True)
class RowsLost:
    """So many rows of a client did not arrive, or were not kept, before a time [s]."""

    t: float
    user: int
    count: int


@dataclass(frozen=True, slots=True)
class Link:
    """State of a client's link.

    Args:
        t: Time [s].
        user: Number of the user.
        round_trip: Mean round trip [s].
        jitter: Mean deviation from it [s].
        clock_offset: The server's clock less the client's [s].
        clock_error: Bound on the error of the offset [s].
    """

    t: float
    user: int
    round_trip: float
    jitter: float
    clock_offset: float
    clock_error: float


@dataclass(frozen=True, slots=True)
class Mark:
    """A mark that a person or a script has set, such as the begin of a trial.

    Args:
        t: Time [s].
        text: What it says.
        fields: Further values as JSON; numbers that are not finite become null.
        by: Number of the user who set it; None for the server or an operator.
        error: Bound on the error of `t` that its sender knows [s]; None without one.
    """

    t: float
    text: str
    fields: Json
    by: int | None = None
    error: float | None = None


@dataclass(frozen=True, slots=True)
class Happened:
    """An event.

    Args:
        t: Time [s].
        kind: Word for its kind, by which analyses tell events apart.
        user: Number of the user whom it concerns; None for nobody.
        text: Sentence for people.
    """

    t: float
    kind: str
    user: int | None
    text: str


@dataclass(frozen=True, slots=True)
class LeftOut:
    """So many entries before a time [s] are not in the file, as the disk was too slow for them."""

    t: float
    count: int


@dataclass(frozen=True, slots=True)
class Damage:
    """Stretch of a file that could not be read; no writer writes it.

    Args:
        t: Time of the first entry that is missing, as far as known [s].
        cut_short: Whether it is the last of the file, as where a write was cut short.
    """

    t: float
    cut_short: bool


Input = (
    Joined | Left | LawSet | Heard | Ticked | PassedOver | Restrained | BudgetSet | BodyReset
    | Asked | Solved
)  # fmt: skip
Output = Patched | Mesh | Shown
Written = SessionInfo | Input | Output | Rows | RowsLost | Link | Mark | Happened | LeftOut
Entry = Written | Damage


def size_of(entry: Entry) -> int:
    """Return about how much memory an entry takes while it waits for the disk [bytes]."""
    match entry:
        case Rows():
            return 400 + len(entry.block)
        case Heard() | Patched() | Mesh() | Shown():
            return 200 + len(entry.frame)
        case _:
            return 1000  # of JSON; a hello has some 500 characters


def nanoseconds(t: float, to_wall: float) -> int:
    """Return a time of the server's clock as the file's index has it.

    The two are rounded before they are added: a sum of 64 bits has steps of 0.2 us.

    Args:
        t: Time on the server's clock [s].
        to_wall: Unix time less the server's clock [s].

    Returns:
        Unix time [ns], 0 for times before its epoch.
    """
    return min(max(0, round(t * 1e9) + round(to_wall * 1e9)), 2**63 - 1)
