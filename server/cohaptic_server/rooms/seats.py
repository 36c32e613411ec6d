"""Seats of all rooms together, of which each room holds some.

A room may seat as many as it holds, and asks nobody when somebody comes: that would take a message
and back. So the sum of what rooms hold never exceeds the total, whatever is lost or late between
the processes. A room that is told to hold fewer says how many it holds then, and only from there on
are they somebody else's.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Seats:
    """Of one room.

    Args:
        most: That it can ever use.
        held: That it may use now, as far as is known for sure: never fewer than it does hold.
        wanted: That it was told to hold.
        used: That were taken when it last said so.
        serial: Of the newest message that told it `wanted`.
    """

    most: int
    held: int = 0
    wanted: int = 0
    used: int = 0
    serial: int = 0


class SeatPool:
    """The seats of all rooms.

    Args:
        total: How many there are.
        most: How many each room can use, by name.
    """

    def __init__(self, total: int, most: Mapping[str, int]) -> None:
        self.total = total
        self._rooms = {room: Seats(number) for room, number in most.items()}

    def __getitem__(self, room: str) -> Seats:
        return self._rooms[room]

    @property
    def free(self) -> int:
        """Seats that no room holds."""
        return self.total - sum(seats.held for seats in self._rooms.values())

    def report(self, room: str, held: int, used: int, serial: int) -> None:
        """A room says how many it holds and uses.

        Args:
            room: Its name.
            held: At most what it was given: what it says beyond that does not count.
            used: By people who are there.
            serial: Of the newest message that it had read by then; another may be on its way, and
                the room may hold more when it has read it.
        """
        seats = self._rooms[room]
        known = min(max(held, 0), seats.held) if serial == seats.serial else seats.held
        self._rooms[room] = replace(seats, held=known, used=max(0, used))

    def lose(self, room: str) -> None:
        """The process of a room has ended: it holds none, and nobody sits there."""
        seats = self._rooms[room]
        self._rooms[room] = Seats(seats.most, serial=seats.serial)

    def share(self, among: Collection[str]) -> dict[str, int]:
        """What rooms are to hold from now on, for those of which that has changed.

        Args:
            among: Rooms that have a process: another one could not give its seats back.

        Who sits keeps its seat. What is free beside them is shared equally by the rooms that can
        use more, the first of them getting one more where it does not come out even.
        """
        rooms = {name: seats for name, seats in self._rooms.items() if name in among}
        spare = self.total - sum(min(s.used, s.most) for s in rooms.values())
        room_left = {name: s.most - min(s.used, s.most) for name, s in rooms.items()}
        targets = _fair(room_left, max(0, spare))
        changed: dict[str, int] = {}
        for name, seats in rooms.items():
            target = min(seats.used, seats.most) + targets[name]
            # Only what no other room may still hold can be given away.
            given = min(target, seats.held + self.free)
            if given != seats.wanted:
                changed[name] = given
                self._rooms[name] = replace(
                    seats, held=max(seats.held, given), wanted=given, serial=seats.serial + 1
                )
        return changed


def _fair(wants: Mapping[str, int], amount: int) -> dict[str, int]:
    """Share an amount equally, nobody getting more than it wants."""
    shares = dict.fromkeys(wants, 0)
    while amount > 0:
        open_ = [name for name in wants if shares[name] < wants[name]]
        if not open_:
            break
        each = max(1, amount // len(open_))
        for name in open_:
            more = min(each, wants[name] - shares[name], amount)
            shares[name] += more
            amount -= more
    return shares
