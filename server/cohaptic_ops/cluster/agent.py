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
from collections.abc import Mapping
from typing import Any, Final

from pydantic import ValidationError

from cohaptic.clock import SystemClock
from cohaptic_ops.cluster.lines import Command, Placed

_NAMESPACE: Final = "cohaptic"
_EVERY = 0.25  # s between two looks; a tenth of a lease
_TOLD_EVERY = 1.0  # s between two lines without news
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

    def placed(self) -> dict[str, str]:
        """Return the machine of each room; empty for one that has none now."""
        machines = {
            node["NodeID"]: str(node["NodeManagerAddress"])
            for node in self._ray.nodes()
            if node["Alive"]
        }
        table: Mapping[str, Any] = self._groups.placement_group_table()
        found = dict[str, str]()
        for group in table.values():
            if group["state"] != "REMOVED":
                there = group["bundles_to_node_id"].get(0, "")
                ready = group["state"] == "CREATED"
                found[group["name"]] = machines.get(there, "") if ready else ""
        return found

    def carry_out(self, command: Command) -> None:
        """Place a room on a machine, or remove it."""
        if command.place:
            wants = {"CPU": command.cores}
            if command.at:
                wants[f"node:{command.at}"] = _A_LITTLE
            self._groups.placement_group(
                [wants],
                strategy="SPREAD",
                name=command.place,
                lifetime="detached",
            )
        if command.remove:
            group = self._groups.get_placement_group(command.remove)
            self._groups.remove_placement_group(group)


def _listen(rooms: _Rooms) -> None:
    for line in sys.stdin:
        try:
            rooms.carry_out(Command.model_validate_json(line))
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
    rooms = _Rooms(ray)
    threading.Thread(target=_listen, args=(rooms,), daemon=True).start()
    clock = SystemClock()
    told, when = "", clock.now()
    while True:
        line = Placed(rooms=rooms.placed()).model_dump_json()
        if line != told or clock.now() - when >= _TOLD_EVERY:
            told, when = line, clock.now()
            print(line, flush=True)
        clock.sleep_until(clock.now() + _EVERY)


if __name__ == "__main__":
    main(sys.argv[1])
