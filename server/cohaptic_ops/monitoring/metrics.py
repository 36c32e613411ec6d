"""What a room and a server tell of themselves, as frozen values that pass between processes.

The metrics of a user have a seat beside its name: a name is a stranger's, and there may be
any number of them over a day, while a room has so many seats and no more.
"""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from cohaptic.protocol.control.capabilities import Capabilities
from cohaptic.status.histogram import TIME_EDGES


class _Frozen(BaseModel):
    # Numbers only: infinity is no JSON, and would pass for a missing value on the way.
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class TimeCounts(_Frozen):
    """A histogram of times.

    Args:
        counts: Numbers of each bucket of `TIME_EDGES` and of what is above, not cumulated.
        total: Sum of all times [s].
    """

    counts: list[int] = Field(min_length=len(TIME_EDGES) + 1, max_length=len(TIME_EDGES) + 1)
    total: float = Field(ge=0.0)


NO_TIMES = TimeCounts(counts=[0] * (len(TIME_EDGES) + 1), total=0.0)


class UserMetrics(_Frozen):
    """One who touches.

    Args:
        seat: Lowest number that was free when it came, from 1.
        name: As it gave it.
        delay: Delay of its loop, as gains are chosen for; None before it was measured [s].
        loss: Share of its samples of late that no tick has used, since newer ones came with them or
            they were too many, 0 to 1.
        silence: Since its newest message [s].
        force: That the body gets of it now [N].
        skipped: Patches that were replaced before they could be sent, so far.
        capabilities: Capabilities of its device, as it says; None if it says nothing.
    """

    seat: int = Field(ge=1)
    name: str
    delay: float | None
    loss: float = Field(ge=0.0, le=1.0)
    silence: float = Field(ge=0.0)
    force: float
    skipped: int = Field(ge=0)
    capabilities: Capabilities | None = None


class RoomMetrics(_Frozen):
    """A room.

    Args:
        hz: Ticks per second that it should have.
        ticks, missed, left_out, slept: As `TickMeters` counts.
        cost, lateness: Histograms of its ticks.
        users: Who touches.
        max_users: Who may touch at once.
        waiting: Who waits for a seat.
        watchers, max_watchers: Who watches, and who may at once.
        lag: Lag of the room [s].
        coupling: Coupling of its hands.
        margin: Margin of their stability; None where they do not couple.
        limited: Times that a user's force was limited in a tick, by why.
        refused: Sessions and requests that were refused, by cause.
        spent: Connections closed for a budget that was spent, by budget.
        connections: That are open.
        received, sent: Bytes.
        processor: Time of processors that its process has taken [s].
        memory: Resident in its process [bytes]; 0 where the system does not tell.
    """

    hz: float = 60.0
    ticks: int = 0
    missed: int = 0
    left_out: int = 0
    slept: int = 0
    cost: TimeCounts = NO_TIMES
    lateness: TimeCounts = NO_TIMES
    users: tuple[UserMetrics, ...] = ()
    max_users: int = 0
    waiting: int = 0
    watchers: int = 0
    max_watchers: int = 0
    lag: float = 0.0
    coupling: float = 0.0
    margin: float | None = None
    limited: dict[str, int] = {}
    refused: dict[str, int] = {}
    spent: dict[str, int] = {}
    connections: int = 0
    received: int = 0
    sent: int = 0
    processor: float = 0.0
    memory: int = 0


class RoomHealth(_Frozen):
    """How a room is, as whoever keeps it knows.

    Args:
        name: Name of the room.
        state: idle, starting, open, broken or stopped.
        problem: Why it is broken.
        restarts: Number of restarts of its process so far.
    """

    name: str
    state: str
    problem: str = ""
    restarts: int = 0


class ServerHealth(_Frozen):
    """How a server is, a few times a second.

    Args:
        version: Version of the program.
        draining: Whether it takes nobody any more, since it is about to end.
        rooms: All of them.
        connections: That are open, at the door.
        refused: Connections that were not taken so far.
    """

    version: str
    draining: bool
    rooms: tuple[RoomHealth, ...]
    connections: int = 0
    refused: int = 0
