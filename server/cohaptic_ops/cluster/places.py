"""Decides what the engine has to do: where somebody waits for a room, it needs a machine. No I/O.

One witness at a time decides: the one that owns `PLACING`, as others own a room. An engine that has
lost its memory, or that puts a room where no server runs, is asked anew.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Final

from cohaptic_ops.cluster.leases import NEVER
from cohaptic_ops.cluster.lines import Command

PLACING: Final = "*"  # no room has this name
_WANTED: Final = 10.0  # s for which a room is wanted after somebody has asked for it
# Time until a room that was placed, and that nobody owns, is placed anew [s]; a node needs less to
# notice that it has a room, and the engine needs less to notice that a machine is lost.
_EMPTY: Final = 8.0
_HOMELESS: Final = 1.0  # s; the same where the engine has no machine, though others may be free
_ANSWERED: Final = 2.0  # s in which a command takes effect


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
    _empty_since: dict[str, float] = field(default_factory=dict[str, float])

    def want(self, room: str, now: float) -> None:
        """Note that somebody has asked for a room."""
        if room in self.cores:
            self.wanted[room] = now

    def is_wanted(self, room: str, now: float) -> bool:
        """Whether a room is to run: always, or since somebody has asked for it lately."""
        return room in self.always or now - self.wanted.get(room, NEVER) < _WANTED

    def commands(
        self, placed: Mapping[str, str], owned: Mapping[str, str], now: float
    ) -> list[Command]:
        """Return what the engine has to do now.

        Args:
            placed: Machine of each room, empty for one that waits for a machine.
            owned: Address (HOST:PORT) of the node that owns each room.
            now: Time [s].
        """
        sought = [room for room in self.wanted if self.is_wanted(room, now)]
        commands = list[Command]()
        for room in {*self.always, *sought, *placed, *(owned.keys() & self.cores.keys())}:
            if room in owned or room not in placed:
                self._empty_since.pop(room, None)
            if room not in placed:
                at = owned.get(room, "").rpartition(":")[0].strip("[]")
                command = Command(place=room, cores=self.cores[room], at=at)
            elif room not in owned and self._is_in_vain(room, placed[room], now):
                command = Command(remove=room)
            else:
                continue
            key = (room, bool(command.remove))
            if now - self._commanded.get(key, NEVER) >= _ANSWERED:
                self._commanded[key] = now
                commands.append(command)
        return commands

    def _is_in_vain(self, room: str, machine: str, now: float) -> bool:
        """Whether a place of a room without an owner is of no use."""
        if room not in self.cores or not self.is_wanted(room, now):
            return True
        patience = _EMPTY if machine else _HOMELESS
        return now - self._empty_since.setdefault(room, now) > patience
