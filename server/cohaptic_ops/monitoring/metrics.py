"""Metrics of a room and health of a server, as frozen values that pass between processes.

The metrics of a user have a seat number beside the name: over a day there may be any number of
names, which strangers choose, while a room has a fixed number of seats.
"""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from cohaptic.protocol.control.message import Capabilities
from cohaptic.status.quantiles import TIME_EDGES


class _Frozen(BaseModel):
    # Infinity is not valid JSON, and would arrive as a missing value.
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class TimeCounts(_Frozen):
    """A histogram of times.

    Args:
        counts: Number of times in each bucket, whose upper edges are `TIME_EDGES` [s], and last the
            number of longer times; not cumulative.
        total: Sum of all times [s].
    """

    counts: list[int] = Field(min_length=len(TIME_EDGES) + 1, max_length=len(TIME_EDGES) + 1)
    total: float = Field(ge=0.0)


NO_TIMES = TimeCounts(counts=[0] * (len(TIME_EDGES) + 1), total=0.0)


class UserMetrics(_Frozen):
    """Metrics of a user who touches.

    Args:
        seat: Lowest seat number that no other user had when this user came, from 1.
        name: Name as the client gave it.
        delay: Delay of the user's haptic loop, from which the server chooses the control gains [s];
            None before the delay is measured.
        loss: Fraction of the user's recent samples that no tick has used, because newer samples
            came in the same tick or there were too many, 0 to 1.
        silence: Time since the user's newest sample, or since joining [s].
        force: Force of the user on the body now [N].
        skipped: Number of patches so far that a newer patch replaced before they were sent.
        capabilities: Capabilities of the device as its client states them; None if it states none.
        sets_lag: Property of this user that the room's lag is for, `damping` or `delay`: no device
            in use may damp less, or no loop is slower. None if the lag is for another user or for
            none in particular.
        forbids_models: Whether this user pressed when models of the hands were last forbidden, and
            its hand cannot be modelled, or its delay jumps; false again once they are used in
            full.
        wavers: Time by which this user's samples are used later than the link's least delay, so
            that nobody feels its jitter [s].
    """

    seat: int = Field(ge=1)
    name: str
    delay: float | None
    loss: float = Field(ge=0.0, le=1.0)
    silence: float = Field(ge=0.0)
    force: float
    skipped: int = Field(ge=0)
    capabilities: Capabilities | None = None
    sets_lag: Literal["damping", "delay"] | None = None
    forbids_models: bool = False
    wavers: float = Field(default=0.0, ge=0.0)


class RoomMetrics(_Frozen):
    """Metrics of a room.

    Args:
        hz: Nominal number of ticks per second.
        ticks, missed, left_out, slept: Numbers of ticks, as `TickMeters` counts them.
        cost: Histogram of the durations of the ticks.
        lateness: Histogram of the delays with which the ticks started.
        users: Metrics of the users who touch.
        max_users: Number of users who may touch at once.
        waiting: Number of people who wait for a seat.
        watchers, max_watchers: Number of watchers, and their largest number at once.
        lag: Lag of the room: time constant of the filter for forces on the body (science 3.8) [s].
        coupling: Spectral radius of the coupling matrix of the users' hands (science 3.8).
        margin: Stability margin of the coupled hands; None if the hands do not couple.
        models: Share of the models in what clients that move models of the hands feel of the
            others, 0 to 1 (science 3.15); None where there is no such client.
        models_off: Reason why that share is below 1, `hand`, `link`, `number` or `object`; empty if
            it is 1, or None. For a hand or a link, `forbids_models` of its user is set.
        limited: Number of times that a user's force was limited in a tick, by reason.
        refused: Numbers of refused sessions and requests, by cause.
        spent: Numbers of connections and responses refused because of a rate limit, by limit.
        connections: Number of open connections.
        received, sent: Numbers of bytes received and sent.
        processor: Processor time that the process has used [s].
        memory: Resident memory of the process [bytes]; 0 if it is unknown.
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
    models: float | None = None
    models_off: Literal["", "hand", "link", "number", "object"] = ""
    limited: dict[str, int] = {}
    refused: dict[str, int] = {}
    spent: dict[str, int] = {}
    connections: int = 0
    received: int = 0
    sent: int = 0
    processor: float = 0.0
    memory: int = 0


class RoomHealth(_Frozen):
    """State of a room and its process.

    Args:
        name: Name of the room.
        state: State of the room: idle, starting, open, broken or stopped.
        problem: Reason why the room is broken; empty if it is not.
        restarts: Number of times that the room's process has ended so far.
    """

    name: str
    state: str
    problem: str = ""
    restarts: int = 0


class ClusterHealth(_Frozen):
    """State of a machine in its cluster.

    Args:
        machine: Address of the machine, HOST:PORT.
        witnesses, answering: Number of witnesses, and of those that have answered lately.
        owned: Number of rooms that the machine owns.
        passed: Number of connections that it passes on to rooms of other machines.
        engine: Whether it has lately heard where the engine places rooms; None where it does not
            ask, since it is no witness.
        decides: Whether it is the witness that tells the engine which rooms are wanted.
    """

    machine: str
    witnesses: int
    answering: int
    owned: int
    passed: int
    engine: bool | None
    decides: bool

    @property
    def holds(self) -> bool:
        """Whether enough witnesses answer for the machine to own rooms."""
        return 2 * self.answering > self.witnesses


class ServerHealth(_Frozen):
    """State of a server: reported once a second for a single room, four times a second for many.

    Args:
        version: Version of the program.
        draining: Whether the server admits no more clients because it is about to end.
        rooms: State of each room.
        connections: Number of open connections of the whole server.
        refused: Number of connections that were refused so far.
        cluster: State of the machine in its cluster; None without one.
    """

    version: str
    draining: bool
    rooms: tuple[RoomHealth, ...]
    connections: int = 0
    refused: int = 0
    cluster: ClusterHealth | None = None
