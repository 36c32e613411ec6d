"""The part of `ray_cluster.py` that runs in Ray's environment, on node 1: rooms, and calls of them.

    python benchmarks/ray_rooms.py rooms|calls

It prints the times of all look-ups and calls [s] as JSON.
"""

from __future__ import annotations

import importlib
import json
import sys
import threading
import time
from typing import Any, Final

from cluster_nodes import NODES, address, tick, until

PORT: Final = 6399  # of the head
ROOMS: Final = 12
_CALLS = 2000


class Room:
    """A room that ticks in a thread beside the actor's calls."""

    def __init__(self, name: str) -> None:
        self.name = name
        threading.Thread(target=tick, args=(name,), daemon=True).start()

    def where(self) -> str:
        """Return the name of the room."""
        return self.name


def main(what: str) -> None:
    """Start all rooms, or call each of them many times."""
    ray: Any = importlib.import_module("ray")
    ray.init(address=f"{address(1)}:{PORT}", log_to_driver=False, logging_level="ERROR")
    until(lambda: sum(node["Alive"] for node in ray.nodes()) == len(NODES))
    actors: Any = ray.remote(num_cpus=0.1, max_restarts=-1)(Room)
    for k in range(ROOMS if what == "rooms" else 0):
        options = {"name": f"room{k}", "namespace": "rooms", "lifetime": "detached"}
        actors.options(**options, scheduling_strategy="SPREAD").remote(f"room{k}")
    looked, called = list[float](), list[float]()
    for k in range(_CALLS if what == "calls" else 0):
        begin = time.perf_counter()
        actor = ray.get_actor(f"room{k % ROOMS}", namespace="rooms")
        found = time.perf_counter()
        ray.get(actor.where.remote())
        looked.append(found - begin)
        called.append(time.perf_counter() - found)
    print(json.dumps([looked, called]))


if __name__ == "__main__":
    main(sys.argv[1])
