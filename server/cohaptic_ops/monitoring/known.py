"""Stores the reports of a server in its admin process, and judges the server's health. No I/O."""

from __future__ import annotations

from dataclasses import dataclass, field

from cohaptic_ops.monitoring.lines import Line, RoomLine, ServerLine
from cohaptic_ops.monitoring.metrics import RoomMetrics, ServerHealth

# Age above which a report is stale [s]: reports come every second, and a machine under load may be
# two reports late.
STALE = 3.0
NO_ROOM = "no such room"


@dataclass(frozen=True, slots=True)
class KnownRoom:
    """Newest report of a room.

    Args:
        metrics: Metrics in the report.
        heard: Time at which the report came [s].
        ticked: Time of the newest report that counted more ticks than the report before it [s];
            None if there was no such report.
    """

    metrics: RoomMetrics
    heard: float
    ticked: float | None

    def fresh(self, now: float) -> bool:
        """Whether the report is at most `STALE` old."""
        return now - self.heard <= STALE

    def ticks(self, now: float) -> bool:
        """Whether the reports of the last `STALE` seconds show that the room ticks."""
        return self.fresh(now) and self.ticked is not None and now - self.ticked <= STALE


@dataclass(slots=True)
class Known:
    """State of a server and all its rooms, according to the server's reports.

    Attributes:
        health: Health of the server; None before its first line.
        heard: Time at which the health came [s].
        rooms: Newest report of each room that the server has, by name of the room.
    """

    health: ServerHealth | None = None
    heard: float = 0.0
    rooms: dict[str, KnownRoom] = field(default_factory=dict[str, KnownRoom])

    def take(self, line: Line, now: float) -> None:
        """Update the state with a line from the server."""
        if isinstance(line, ServerLine):
            self.health, self.heard = line.health, now
            there = {room.name for room in line.health.rooms}
            self.rooms = {name: room for name, room in self.rooms.items() if name in there}
        elif isinstance(line, RoomLine):
            before = self.rooms.get(line.room)
            # Fewer ticks than before mean a new process. One report alone cannot show progress.
            moved = before is not None and line.metrics.ticks > before.metrics.ticks
            ticked = now if moved else None if before is None else before.ticked
            self.rooms[line.room] = KnownRoom(line.metrics, now, ticked)

    def why_not_alive(self, now: float) -> list[str]:
        """Return the reasons why the server does not count as alive; empty if it does."""
        if self.health is None:
            return ["the server has not said anything yet"]
        if now - self.heard > STALE:
            return [f"the server has said nothing for {now - self.heard:.1f} s"]
        return []

    def why_not_ticking(self, now: float) -> dict[str, str]:
        """Return the names of the rooms that do not tick, each with the known reason."""
        if self.health is None:
            return {}
        found: dict[str, str] = {}
        for room in self.health.rooms:
            known = self.rooms.get(room.name)
            if room.state != "open":
                found[room.name] = room.state + (f": {room.problem}" if room.problem else "")
            elif known is None:
                found[room.name] = "no report yet"
            elif not known.fresh(now):
                found[room.name] = f"no report for {now - known.heard:.1f} s"
            elif not known.ticks(now):
                found[room.name] = "does not tick"
        return found

    def why_not_ready(self, now: float, room: str | None = None) -> list[str]:
        """Return the reasons why the server, or one room, is not ready for people; empty if it is.

        A server is ready if at least one room ticks or is idle, and no room is starting for the
        first time. One broken room must not keep people from the other rooms.

        Args:
            now: Time [s].
            room: Name of the only room to judge; None judges the server.
        """
        if why := self.why_not_alive(now):
            return why
        assert self.health is not None
        if self.health.draining:
            return ["the server is draining"]
        cluster = self.health.cluster
        if cluster is not None and not cluster.holds:
            return [f"{cluster.answering} of {cluster.witnesses} witnesses answer"]
        waits = {one.name for one in self.health.rooms if one.state == "idle"}
        # An idle room counts as ready, since it starts when somebody comes.
        silent = {n: why for n, why in self.why_not_ticking(now).items() if n not in waits}
        if room is not None:
            names = {one.name for one in self.health.rooms}
            return [silent[room]] if room in silent else [] if room in names else [NO_ROOM]
        starts = any(one.state == "starting" and not one.restarts for one in self.health.rooms)
        if starts or len(silent) == len(self.health.rooms):
            return [f"room {name}: {why}" for name, why in silent.items()]
        return []
