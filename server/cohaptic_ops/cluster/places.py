"""Decides what the engine has to do: where somebody waits for a room, it needs a machine. No I/O.

One witness at a time decides: the one that owns `PLACING`, as others own a room. An engine that has
lost its memory, or that puts a room where no server runs, is asked anew.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Final

from cohaptic_ops.cluster.lines import Command

PLACING: Final = "*"  # no room has this name
_WANTED: Final = 10.0  # s for which a room is wanted after somebody has asked for it
# Time until a room that was placed, and that nobody owns, is placed anew [s]; a node needs less to
# notice that it has a room, and the engine needs less to notice that a machine is lost.
_EMPTY: Final = 8.0
_HOMELESS: Final = 1.5  # s; the same where the engine has no machine, though others may be free
_ANSWERED: Final = 2.0  # s in which a command takes effect


@dataclass
class Places:
    """Places of the rooms as one witness wants them.

    Args:
        cores: Processors that each room needs, by name.
        always: Rooms that run even if nobody asks for them.
    """

    cores: Mapping[str, float]
    always: Collection[str]
    _wanted: dict[str, float] = field(default_factory=dict[str, float])
    _commanded: dict[str, float] = field(default_factory=dict[str, float])
    _empty_since: dict[str, float] = field(default_factory=dict[str, float])

    def want(self, room: str, now: float) -> None:
        """Note that somebody has asked for a room."""
        if room in self.cores:
            self._wanted[room] = now

    def commands(
        self, placed: Mapping[str, str], owned: Mapping[str, str], now: float
    ) -> list[Command]:
        """Return what the engine has to do now.

        Args:
            placed: Machine of each room, empty for one that waits for a machine.
            owned: Address (HOST:PORT) of the node that owns each room.
            now: Time [s].
        """
        self._wanted = {room: at for room, at in self._wanted.items() if now - at < _WANTED}
        commands = list[Command]()
        for room in {*self.always, *self._wanted, *placed, *(owned.keys() & self.cores.keys())}:
            if room in owned:
                self._empty_since.pop(room, None)
            if now - self._commanded.get(room, -_ANSWERED) < _ANSWERED:
                continue
            wanted = room in self.cores and (room in self.always or room in self._wanted)
            patience = _EMPTY if placed.get(room) else _HOMELESS
            if room not in placed:
                at = owned.get(room, "").rpartition(":")[0].strip("[]")
                commands.append(Command(place=room, cores=self.cores[room], at=at))
            elif room not in owned and (
                not wanted or now - self._empty_since.setdefault(room, now) > patience
            ):
                commands.append(Command(remove=room))
            else:
                continue
            self._commanded[room] = now
        return commands
