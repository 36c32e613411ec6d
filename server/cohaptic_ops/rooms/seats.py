"""Divides the seats of a server among its rooms. No I/O.

The rooms share a total number of seats, and each room holds some of them: the rooms server has
assigned these seats to the room. A room may seat as many people as it holds seats, without asking
the rooms server. The sum of the held seats never exceeds the total, even if messages between the
processes are lost or late: if a room has to hold fewer seats, it first reports the smaller number,
and only then another room gets the freed seats.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Seats:
    """Seats that the rooms server has assigned to one room.

    Args:
        limit: Largest number of seats that the room can use.
        held: Upper bound of the number of seats that the room holds now.
        wanted: Number of seats that the newest message allows the room to hold.
        used: Number of taken seats in the room's newest report.
        serial: Serial number of the newest message with `wanted` to the room.
    """

    limit: int
    held: int = 0
    wanted: int = 0
    used: int = 0
    serial: int = 0


class SeatPool:
    """Divides the seats of a server among its rooms.

    Args:
        total: Number of seats.
        limit: Largest number of seats that each room can use, by name of the room.
    """

    def __init__(self, total: int, limit: Mapping[str, int]) -> None:
        self.total = total
        self._rooms = {room: Seats(number) for room, number in limit.items()}

    def __getitem__(self, room: str) -> Seats:
        return self._rooms[room]

    @property
    def free(self) -> int:
        """Number of seats that no room holds."""
        return self.total - sum(seats.held for seats in self._rooms.values())

    def report(self, room: str, held: int, used: int, serial: int) -> None:
        """Update the known seats of a room from its report.

        Args:
            room: Name of the room.
            held: Number of seats that the room holds; the known number is lowered to it, but never
                raised.
            used: Number of taken seats.
            serial: Serial number of the newest message that the room had read. If a newer message
                is still on its way, the known number of held seats stays.
        """
        seats = self._rooms[room]
        known = min(max(held, 0), seats.held) if serial == seats.serial else seats.held
        self._rooms[room] = replace(seats, held=known, used=max(0, used))

    def lose(self, room: str) -> None:
        """Take all seats back from a room whose process has ended."""
        seats = self._rooms[room]
        self._rooms[room] = Seats(seats.limit, serial=seats.serial)

    def share(self, among: Collection[str]) -> dict[str, int]:
        """Divide the seats anew; return the new number of seats of each room where it changes.

        People keep the seats that they have. The rooms that can use more seats share the remaining
        ones equally; if the division leaves a remainder, the rooms with the fewest people get one
        more, so that no room lacks a seat for its first visitor while another has one to spare.

        Args:
            among: Names of the rooms that have a process, without which no room can free its seats.
        """
        open_rooms = ((name, self._rooms[name]) for name in among)
        rooms = dict(sorted(open_rooms, key=lambda room: room[1].used))
        spare = self.total - sum(min(s.used, s.limit) for s in rooms.values())
        room_left = {name: s.limit - min(s.used, s.limit) for name, s in rooms.items()}
        targets = _fair(room_left, max(0, spare))
        changed: dict[str, int] = {}
        for name, seats in rooms.items():
            target = min(seats.used, seats.limit) + targets[name]
            # A room can only get seats that no other room may still hold.
            given = min(target, seats.held + self.free)
            if given != seats.wanted:
                changed[name] = given
                self._rooms[name] = replace(
                    seats, held=max(seats.held, given), wanted=given, serial=seats.serial + 1
                )
        return changed


def _fair(wants: Mapping[str, int], amount: int) -> dict[str, int]:
    """Divide `amount` equally, but give no name more than its number in `wants`."""
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
