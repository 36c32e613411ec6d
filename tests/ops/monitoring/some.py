"""Metrics of rooms and servers, for the tests of what is told of them."""

from __future__ import annotations

from cohaptic.status.quantiles import Histogram
from cohaptic_ops.monitoring.known import Known
from cohaptic_ops.monitoring.lines import RoomLine, ServerLine
from cohaptic_ops.monitoring.metrics import (
    ClusterHealth,
    RoomHealth,
    RoomMetrics,
    ServerHealth,
    TimeCounts,
    UserMetrics,
)


def times(*values: float) -> TimeCounts:
    histogram = Histogram()
    for value in values:
        histogram.add(value)
    return TimeCounts(counts=histogram.counts, total=histogram.total)


def user(seat: int = 1, name: str = "ada", **more: float | str | None) -> UserMetrics:
    reported = {"delay": 0.05, "loss": 0.25, "silence": 0.01, "force": 1.5, "skipped": 3} | more
    return UserMetrics.model_validate({"seat": seat, "name": name} | reported)


def cluster(answering: int = 3, *, decides: bool = True) -> ClusterHealth:
    """A machine in a cluster with three witnesses."""
    return ClusterHealth(
        machine="10.0.0.2:8764", witnesses=3, answering=answering, owned=4, passed=12, engine=True,
        decides=decides,
    )  # fmt: skip


def health(
    *rooms: RoomHealth, draining: bool = False, cluster: ClusterHealth | None = None
) -> ServerLine:
    found = rooms or (RoomHealth(name="main", state="open"),)
    return ServerLine(
        health=ServerHealth(version="1", draining=draining, rooms=found, cluster=cluster)
    )


def room(name: str = "main", ticks: int = 60, **more: object) -> RoomLine:
    metrics = RoomMetrics.model_validate({"ticks": ticks, "max_users": 16} | more)
    return RoomLine(room=name, metrics=metrics)


def ticking(*rooms: RoomLine) -> Known:
    """Of rooms that tick at 1 s."""
    known, given = Known(), rooms or (room(),)
    known.take(health(*(RoomHealth(name=line.room, state="open") for line in given)), 0.0)
    for line in given:
        known.take(room(line.room, line.metrics.ticks - 1), 0.0)
    known.take(health(*(RoomHealth(name=line.room, state="open") for line in given)), 1.0)
    for line in given:
        known.take(line, 1.0)
    return known
