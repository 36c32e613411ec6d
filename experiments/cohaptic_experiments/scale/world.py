"""Machines, rooms and people over a day, event by event. No I/O, no clock.

People come at random and choose a room, often one of a few that many choose. A room starts where
most processors are free, and ends when it has been empty for a while. Machines fail, come back, and
are updated one group after another; the engine's head is gone for a while, and remembers all. The
witnesses and the machine of the head are others, which do not fail. Recorded is how long people are
without touch, and why.
"""

from __future__ import annotations

import heapq
import math
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

DAY = 86_400.0  # s


@dataclass(frozen=True, slots=True)
class Costs:
    """Measured costs; see `benchmarks/cluster.py`.

    Args:
        term: Duration of a lease, as witnesses keep it [s].
        noticed: Shortest and longest time until the engine has placed the rooms of a lost machine
            elsewhere [s].
        felt: Shortest and longest time until somebody notices the loss and is back [s], if the room
            is there by then.
        reported: Shortest and longest time without touch when a machine is told to end, but for the
            start of the room [s].
        alone: Time until the witnesses place rooms by themselves once the head is lost [s].
        asked: Time until a node hears that it has a room, and owns it [s].
        look: Time in which a witness sees where one room is placed [s]; it looks at all of them
            one after another, every `looks` seconds or three times as slowly as it can.
        opening: Processor time to open a room [s]; a machine opens as many at once as it has cores.
        room: Processors that an open room takes.
        person: Processors that each person in it takes.
    """

    term: float = 2.63
    noticed: tuple[float, float] = (2.0, 3.0)
    felt: tuple[float, float] = (0.1, 2.5)
    reported: tuple[float, float] = (0.3, 0.9)
    alone: float = 3.1
    asked: float = 0.45
    look: float = 36e-6
    looks: float = 0.25
    opening: float = 0.3
    room: float = 0.03
    person: float = 0.03


@dataclass(frozen=True, slots=True)
class Plan:
    """What happens in the day.

    Args:
        rooms: Number of rooms that are defined.
        seats: Number of people who may be in one; whoever finds it full chooses another.
        machines: Number of machines; further ones join.
        cores: Processors of each.
        reserved: Processors that the engine reserves for a room (`rooms.NAME.cores`).
        people: Number of people at once, on average over the day.
        stay: Mean time that a person stays [s].
        idle: Time after which an empty room ends [s].
        between_failures: Mean time between two failures of one machine [s].
        repaired: Time until a failed machine is back [s].
        joins: Machines that join in the course of the day.
        update: Time at which the update begins [s].
        at_once: Machines that are updated at the same time.
        away: Time that a machine is away for its update [s].
        head_gone: Time at which the head is lost [s], and for how long [s].
        seed: Of everything that is random.
    """

    rooms: int = 10_000
    seats: int = 16
    machines: int = 400
    cores: int = 4
    reserved: float = 0.2
    people: float = 8_000.0
    stay: float = 1_200.0
    idle: float = 600.0
    between_failures: float = 30.0 * DAY
    repaired: float = 600.0
    joins: int = 20
    update: float = 10.0 * 3600.0
    at_once: int = 4
    away: float = 60.0
    head_gone: tuple[float, float] = (15.0 * 3600.0, 60.0)
    seed: int = 0


@dataclass
class Machine:
    """A machine.

    Attributes:
        there: Whether it runs.
        rooms: Rooms that it owns.
        opens: Times at which each of its processors has opened the rooms that wait for it [s].
        used: Processors in use.
    """

    there: bool = True
    rooms: set[int] = field(default_factory=set[int])
    opens: list[float] = field(default_factory=list[float])
    used: float = 0.0


@dataclass
class Record:
    """What was seen.

    Attributes:
        silences: Times without touch, by cause [s]; one for each person and event.
        waits: Times that the first person waited for a room that had ended [s].
        refused: Number of people for whom no machine had processors.
        joined: Number of people who came.
        touched: Time that people were in rooms together [s].
        samples: For each minute: people, open rooms, processors in use, machines that run.
        asked: Look-ups of rooms.
    """

    silences: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    waits: list[float] = field(default_factory=list[float])
    refused: int = 0
    joined: int = 0
    touched: float = 0.0
    samples: list[tuple[float, int, int, float, int]] = field(
        default_factory=list[tuple[float, int, int, float, int]]
    )
    asked: int = 0


class World:
    """One day of a cluster.

    Args:
        plan: What happens.
        costs: What it costs.
    """

    def __init__(self, plan: Plan, costs: Costs) -> None:
        self.plan, self.costs = plan, costs
        self.record = Record()
        self.machines = [self._machine() for _ in range(plan.machines)]
        self.people = np.zeros(plan.rooms, dtype=np.int64)
        self.owner = np.full(plan.rooms, -1)
        self._emptied = np.zeros(plan.rooms)
        self._chance = np.random.default_rng(plan.seed)
        # As many choose the k-th room as 1 / k^0.7 says: the first is the first choice of 2 %.
        weights = 1.0 / np.arange(1, plan.rooms + 1) ** 0.7
        self._chosen = np.cumsum(weights / weights.sum())
        self._events: list[tuple[float, int, Callable[[], None]]] = []
        self._order = 0
        self.now = 0.0

    def run(self, progress: Callable[[float], None]) -> Record:
        """Let the day pass."""
        plan = self.plan
        self._after(0.0, self._somebody_comes)
        self._after(0.0, self._sample)
        for k in range(plan.machines):
            self._fail_later(k)
        for k in range(plan.joins):
            self._after(DAY * (k + 1) / (plan.joins + 1), self._join)
        self._after(plan.update, lambda: self._update(0))
        shown = 0.0
        while self._events and self._events[0][0] < DAY:
            self.now, _, happen = heapq.heappop(self._events)
            happen()
            if self.now > shown:
                progress(self.now / DAY)
                shown = self.now + 0.01 * DAY
        progress(1.0)
        return self.record

    def _machine(self) -> Machine:
        return Machine(opens=[0.0] * self.plan.cores)

    def _after(self, seconds: float, happen: Callable[[], None]) -> None:
        self._order += 1
        heapq.heappush(self._events, (self.now + seconds, self._order, happen))

    def _between(self, limits: tuple[float, float]) -> float:
        return float(self._chance.uniform(*limits))

    def _sample(self) -> None:
        there = [one for one in self.machines if one.there]
        used = sum(one.used for one in there)
        self.record.samples.append(
            (self.now, int(self.people.sum()), int((self.owner >= 0).sum()), used, len(there))
        )
        self._after(60.0, self._sample)

    # People.

    def _somebody_comes(self) -> None:
        plan = self.plan
        # Twice as many in the afternoon as on average, hardly anybody in the night.
        rate = plan.people / plan.stay * (1.0 - math.cos(2.0 * math.pi * (self.now / DAY - 0.125)))
        self._after(float(self._chance.exponential(1.0 / max(rate, 1e-3))), self._somebody_comes)
        self.record.joined += 1
        room = self._choose()
        while self.people[room] >= plan.seats:
            room = self._choose()
        self.record.asked += 1
        if self.owner[room] < 0:
            open_at = self._place(room, self.now + self.costs.asked)
            if open_at is None:
                self.record.refused += 1
                return
            self.record.waits.append(open_at - self.now)
        self.people[room] += 1
        self._use(room, self.costs.person)
        stay = float(self._chance.exponential(plan.stay))
        self.record.touched += min(stay, DAY - self.now)
        self._after(stay, lambda: self._somebody_goes(room))

    def _choose(self) -> int:
        return int(np.searchsorted(self._chosen, self._chance.random()))

    def _somebody_goes(self, room: int) -> None:
        if not self.people[room]:  # no machine had processors for the room when its own was lost
            return
        self.people[room] -= 1
        self._use(room, -self.costs.person)
        if not self.people[room]:
            self._emptied[room] = self.now
            self._after(self.plan.idle, lambda: self._rest(room))

    def _rest(self, room: int) -> None:
        owner = int(self.owner[room])
        waited = self.now - self._emptied[room] >= self.plan.idle
        if not self.people[room] and owner >= 0 and waited:
            self._end(room)

    # Rooms.

    def _use(self, room: int, cores: float) -> None:
        owner = int(self.owner[room])
        if owner >= 0:
            self.machines[owner].used += cores

    def _end(self, room: int) -> None:
        machine = self.machines[int(self.owner[room])]
        machine.rooms.discard(room)
        machine.used -= self.costs.room + self.costs.person * float(self.people[room])
        self.owner[room] = -1

    def _place(self, room: int, at: float) -> float | None:
        """Let the machine with most free processors open a room; return when it is open [s]."""
        needs = self.costs.room + self.costs.person * float(self.people[room])
        there = [k for k, one in enumerate(self.machines) if one.there]
        best = min(there, key=lambda k: len(self.machines[k].rooms), default=-1)
        limit = int(self.plan.cores / self.plan.reserved + 1e-9)
        if best < 0 or len(self.machines[best].rooms) >= limit:
            return None
        begin, gone = self.plan.head_gone
        if begin <= at < begin + min(gone, self.costs.alone):
            at = begin + self.costs.alone  # nobody places it until then
        machine = self.machines[best]
        machine.rooms.add(room)
        machine.used += needs
        self.owner[room] = best
        free = heapq.heappop(machine.opens)
        open_at = max(at, free) + self.costs.opening
        heapq.heappush(machine.opens, open_at)
        return open_at

    def _lose(self, k: int, cause: str) -> None:
        """Take the rooms of a machine; those with people start elsewhere."""
        costs, machine = self.costs, self.machines[k]
        rooms = sorted(machine.rooms)
        for room in rooms:
            self._end(room)
        machine.there = False
        look = costs.look * float((self.owner >= 0).sum())
        seen = look + self._between((0.0, max(costs.looks, 3.0 * look)))
        noticed = self.now + max(costs.term, self._between(costs.noticed) + seen) + costs.asked
        for room in rooms:
            count = int(self.people[room])
            if not count:
                continue
            reported = cause == "update"
            at = self.now + self._between(costs.reported) if reported else noticed
            open_at = self._place(room, at)
            if open_at is None:
                self.record.refused += count
                self.people[room] = 0
                continue
            for _ in range(count):
                back = self.now + (0.0 if reported else self._between(costs.felt))
                self.record.silences[cause].append(max(open_at, back) + 0.1 - self.now)
            self.record.asked += count

    # Machines.

    def _fail_later(self, k: int) -> None:
        mean = self.plan.between_failures
        self._after(float(self._chance.exponential(mean)), lambda: self._fail(k))

    def _fail(self, k: int) -> None:
        if self.machines[k].there:
            self._lose(k, "failure")
            self._after(self.plan.repaired, lambda: self._come_back(k))
        self._fail_later(k)

    def _come_back(self, k: int) -> None:
        self.machines[k] = self._machine()
        self.machines[k].opens = [self.now] * self.plan.cores

    def _join(self) -> None:
        self.machines.append(self._machine())
        self._fail_later(len(self.machines) - 1)

    def _update(self, first: int) -> None:
        """Update one group of machines, and the next one when they are back."""
        group = [k for k in range(first, first + self.plan.at_once) if k < len(self.machines)]
        for k in group:
            if self.machines[k].there:
                self._lose(k, "update")
                self._after(self.plan.away, partial(self._come_back, k))
        if group:
            after = first + self.plan.at_once
            self._after(self.plan.away + 5.0, lambda: self._update(after))
