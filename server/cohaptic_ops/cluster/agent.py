"""The program that speaks with the engine: `python -m cohaptic_ops.cluster.agent ADDRESS`.

It is a process of its own, which `engine` starts again whenever it ends: Ray ends each process that
cannot reach its head for a while, and rooms must outlive that. Ray is imported here alone.

A room is a placement group of one bundle, which needs no process of Ray's. Ray chooses a machine
with enough free processors, and another one when that machine is lost. The program reads `Command`
lines, and writes a `Placed` line whenever that changes, and once a second.
"""

from __future__ import annotations

import importlib
import logging
import os
import sys
import threading
from collections.abc import Mapping, Sequence
from typing import Any, Final

from pydantic import ValidationError

from cohaptic.clock import Clock, SystemClock
from cohaptic_ops.cluster.lines import Command, Placed

_NAMESPACE: Final = "cohaptic"
_EVERY = 0.25  # s between two looks; a tenth of a lease
# A look takes 36 us for each room, and the next one comes after this many times as long at least.
_PAUSE: Final = 2.0
_REPORT_EVERY = 1.0  # s between two lines without news
_PLACED_WITHIN: Final = 1.0  # s in which Ray usually finds a machine for a room
_SOON: Final = 0.05  # s between two looks at such a room
# Of the one unit that each machine has of the resource with its name, for a room that is there.
_A_LITTLE: Final = 1e-4


class _Rooms:
    """The placement groups of all rooms.

    Args:
        ray: Module of that name.
    """

    def __init__(self, ray: Any) -> None:
        self._ray = ray
        self._groups: Any = importlib.import_module("ray.util.placement_group")
        self._new: dict[str, tuple[Any, float]] = {}

    def placed(self) -> dict[str, str]:
        """Return the machine of each room; empty for one that has none now."""
        table: Mapping[str, Any] = self._groups.placement_group_table()
        return self._report(list(table.values()))

    def place(self, command: Command, now: float) -> None:
        """Let Ray choose a machine for a room; `news` tells which, if that takes little time."""
        wants = {"CPU": command.cores}
        if command.at:
            wants[f"node:{command.at}"] = _A_LITTLE
        group = self._groups.placement_group(
            [wants], strategy="SPREAD", name=command.place, lifetime="detached"
        )
        self._new[command.place] = group, now + _PLACED_WITHIN

    def news(self, now: float) -> dict[str, str]:
        """Return the machines of new rooms that have got one since the last call."""
        found = dict[str, str]()
        for room, (group, until) in list(self._new.items()):
            reported = self._report([self._groups.placement_group_table(group)])
            if reported.get(room) or now > until:
                del self._new[room]
                found |= reported if reported.get(room) else {}
        return found

    def remove(self, room: str) -> None:
        """Place a room nowhere any more."""
        self._groups.remove_placement_group(self._groups.get_placement_group(room))

    def _report(self, table: Sequence[Mapping[str, Any]]) -> dict[str, str]:
        machines = {
            node["NodeID"]: str(node["NodeManagerAddress"])
            for node in self._ray.nodes()
            if node["Alive"]
        }
        found = dict[str, str]()
        for group in table:
            if group["state"] != "REMOVED":
                there = group["bundles_to_node_id"].get(0, "")
                ready = group["state"] == "CREATED"
                found[group["name"]] = machines.get(there, "") if ready else ""
        return found


def _listen(rooms: _Rooms, clock: Clock) -> None:
    for line in sys.stdin:
        try:
            command = Command.model_validate_json(line)
            if command.place:
                rooms.place(command, clock.now())
            if command.remove:
                rooms.remove(command.remove)
        except ValidationError:
            logging.exception("a command is wrong")
        except Exception as error:
            logging.warning("the engine refuses %s: %s", line.strip(), error)
    os._exit(0)  # the server has ended


def main(address: str) -> None:
    """Tell where rooms are placed, until the engine ends this process."""
    ray: Any = importlib.import_module("ray")
    ray.init(
        address=address, namespace=_NAMESPACE, log_to_driver=False, logging_level="ERROR",
        configure_logging=False,
    )  # fmt: skip
    rooms, clock = _Rooms(ray), SystemClock()
    threading.Thread(target=_listen, args=(rooms, clock), daemon=True).start()
    reported, when = Placed(more=True), clock.now()
    while True:
        begin = clock.now()
        line = Placed(rooms=rooms.placed())
        if line != reported or begin - when >= _REPORT_EVERY:
            reported, when = line, begin
            print(line.model_dump_json(), flush=True)
        again = begin + max(_EVERY, (1.0 + _PAUSE) * (clock.now() - begin))
        while clock.now() < again:
            clock.sleep_until(min(again, clock.now() + _SOON))
            news = rooms.news(clock.now())
            if news:
                print(Placed(rooms=news, more=True).model_dump_json(), flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
