"""Decides what the engine has to do: where somebody waits for a room, it needs a machine. No I/O.

One witness at a time decides: the one that owns `PLACING`, as others own a room. An engine that has
lost its memory, or that puts a room where no server runs, is asked anew. While the engine is away,
the witnesses share the rooms out by themselves.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Final

from cohaptic_ops.cluster.addresses import host_of
from cohaptic_ops.cluster.leases import NEVER
from cohaptic_ops.cluster.lines import Command

PLACING: Final = "*"  # no room has this name
_WANTED: Final = 10.0  # s for which a room is wanted after somebody has asked for it
# Time until a room is placed anew if nobody owns it, or another machine does [s]; a node needs less
# to notice that it has a room, and the engine needs less to notice that a machine is lost.
_WRONG: Final = 8.0
_HOMELESS: Final = 1.0  # s; the same where the engine has no machine, though others may be free
_ANSWERED: Final = 2.0  # s in which a command takes effect
_ROUNDING: Final = 1e-6  # processors


@dataclass
class Places:
    """Places of the rooms as one witness wants them.

    Args:
        cores: Processors that each room needs, by name.
        always: Rooms that run even if nobody asks for them.

    Attributes:
        wanted: Time at which somebody has last asked for each room [s].
    """

    cores: Mapping[str, float]
    always: Collection[str]
    wanted: dict[str, float] = field(default_factory=dict[str, float])
    _commanded: dict[tuple[str, bool], float] = field(default_factory=dict[tuple[str, bool], float])
    _wrong_since: dict[str, float] = field(default_factory=dict[str, float])

    def want(self, room: str, now: float) -> None:
        """Note that somebody has asked for a room."""
        if room in self.cores:
            self.wanted[room] = now

    def is_wanted(self, room: str, now: float) -> bool:
        """Whether a room is to run: always, or since somebody has asked for it lately."""
        return room in self.always or now - self.wanted.get(room, NEVER) < _WANTED

    def sought(self, now: float) -> set[str]:
        """Return the rooms that are to run."""
        return {*self.always, *(room for room in self.wanted if self.is_wanted(room, now))}

    def commands(
        self, placed: Mapping[str, str], owned: Mapping[str, str], now: float
    ) -> list[Command]:
        """Return what the engine has to do now.

        Args:
            placed: Machine of each room, empty for one that waits for a machine.
            owned: Address (HOST:PORT) of the node that owns each room.
            now: Time [s].
        """
        commands = list[Command]()
        for room in {*self.sought(now), *placed, *(owned.keys() & self.cores.keys())}:
            at = host_of(owned.get(room, ""))
            is_right = bool(at) and placed.get(room) in (at, "")
            if is_right or room not in placed:
                self._wrong_since.pop(room, None)
            if room not in placed:
                command = Command(place=room, cores=self.cores[room], at=at)
            elif not is_right and self._is_in_vain(room, placed[room], now, owned=bool(at)):
                command = Command(remove=room)
            else:
                continue
            key = (room, bool(command.remove))
            if now - self._commanded.get(key, NEVER) >= _ANSWERED:
                self._commanded[key] = now
                commands.append(command)
        return commands

    def _is_in_vain(self, room: str, machine: str, now: float, *, owned: bool) -> bool:
        """Whether a place is of no use for a room that another machine, or nobody, owns."""
        if not owned and (room not in self.cores or not self.is_wanted(room, now)):
            return True
        patience = _WRONG if machine else _HOMELESS
        return now - self._wrong_since.setdefault(room, now) > patience


def share_out(
    rooms: Collection[str],
    processors: Mapping[str, float],
    owned: Mapping[str, str],
    cores: Mapping[str, float],
) -> dict[str, str]:
    """Return a machine for each room while the engine is away: the one with most processors free.

    Witnesses that know the same choose the same.

    Args:
        rooms: Rooms that need a machine; one for which not enough is free anywhere gets none.
        processors: Number of processors of each machine.
        owned: Machines of the rooms that have an owner.
        cores: Processors that each room needs, by name.
    """
    free, chosen = dict(sorted(processors.items())), dict[str, str]()
    for room, machine in owned.items():
        if machine in free:
            free[machine] -= cores.get(room, 0.0)
    for room in sorted(rooms):
        machine = max(free, key=free.__getitem__, default="")
        if free.get(machine, 0.0) >= cores[room] - _ROUNDING:
            free[machine] -= cores[room]
            chosen[room] = machine
    return chosen
