"""What the process of an admin port knows of its server, and what that says of its health. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field

from cohaptic_ops.monitoring.lines import Line, RoomLine, ServerLine
from cohaptic_ops.monitoring.metrics import RoomMetrics, ServerHealth

# s; a report comes every second, and a machine under load may be two late.
STALE = 3.0
NO_ROOM = "no such room"


@dataclass(frozen=True, slots=True)
class KnownRoom:
    """A room by its newest report.

    Args:
        metrics: The report.
        heard: When it came [s].
        ticked: When a report last had more ticks than the one before [s]; None before.
    """

    metrics: RoomMetrics
    heard: float
    ticked: float | None

    def fresh(self, now: float) -> bool:
        """Whether it says how the room is now."""
        return now - self.heard <= STALE

    def ticks(self, now: float) -> bool:
        """Whether the room ticks."""
        return self.fresh(now) and self.ticked is not None and now - self.ticked <= STALE


@dataclass(slots=True)
class Known:
    """All of it.

    Attributes:
        health: Health of the server; None before its first line.
        heard: When that came [s].
        rooms: By name; only rooms that the server has.
    """

    health: ServerHealth | None = None
    heard: float = 0.0
    rooms: dict[str, KnownRoom] = field(default_factory=dict[str, KnownRoom])

    def take(self, line: Line, now: float) -> None:
        """Learn what a line says."""
        if isinstance(line, ServerLine):
            self.health, self.heard = line.health, now
            there = {room.name for room in line.health.rooms}
            self.rooms = {name: room for name, room in self.rooms.items() if name in there}
        elif isinstance(line, RoomLine):
            before = self.rooms.get(line.room)
            # Fewer ticks are those of a new process. The first report says nothing of movement.
            moved = before is not None and line.metrics.ticks > before.metrics.ticks
            ticked = now if moved else None if before is None else before.ticked
            self.rooms[line.room] = KnownRoom(line.metrics, now, ticked)

    def why_not_alive(self, now: float) -> list[str]:
        """Why the server does not count as alive; empty if it does."""
        if self.health is None:
            return ["the server has not said anything yet"]
        if now - self.heard > STALE:
            return [f"the server has said nothing for {now - self.heard:.1f} s"]
        return []

    def why_not_ticking(self, now: float) -> dict[str, str]:
        """Rooms that do not tick, and what is known of why."""
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
        """Why nobody should be sent here; empty if people may come.

        A server is ready when it ticks: with several rooms, when one of them does and none is at
        its first start, since one broken room is no reason to send nobody to the others. Whoever
        wants to know of one room asks for it.

        Args:
            now: Time [s].
            room: Only this one.
        """
        if why := self.why_not_alive(now):
            return why
        assert self.health is not None
        if self.health.draining:
            return ["the server is draining"]
        waits = {one.name for one in self.health.rooms if one.state == "idle"}
        # One that starts on demand ticks for whoever comes.
        silent = {n: why for n, why in self.why_not_ticking(now).items() if n not in waits}
        if room is not None:
            names = {one.name for one in self.health.rooms}
            return [silent[room]] if room in silent else [] if room in names else [NO_ROOM]
        starts = any(one.state == "starting" and not one.restarts for one in self.health.rooms)
        if starts or len(silent) == len(self.health.rooms):
            return [f"room {name}: {why}" for name, why in silent.items()]
        return []
