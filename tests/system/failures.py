"""What befalls machines that share rooms; each returns its cost once all hands touch again."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable

from tests.system.cluster import CLOCK, ROOMS, Cluster, Cost, lives

AWAY = 60.0  # s for which the head is gone
PAUSED = 6.0  # s; longer than a lease


async def kill_room(cluster: Cluster, room: str, machine: int) -> Cost:
    """It comes back on its machine, and no other hand loses its connection."""
    pid, others, begin = cluster.rooms(machine)[room], cluster.others([room]), CLOCK.now()
    os.kill(pid, signal.SIGKILL)
    await cluster.until(lambda: cluster.rooms(machine).get(room, pid) != pid)
    return await cluster.cost([room], begin, others)


async def lose_head(cluster: Cluster) -> Cost:
    """For a minute, after which it remembers nothing: nobody notices, and no room moves."""
    before, begin = cluster.place(), CLOCK.now()
    cluster.end_head()
    await asyncio.sleep(AWAY)
    cluster.start_head()
    await cluster.until_joined([0])
    await asyncio.sleep(10.0)  # the others come back to the new head
    assert cluster.place() == before
    return await cluster.cost([], begin, cluster.hands)


async def kill_machine(cluster: Cluster, machine: int) -> Cost:
    """Its rooms are on others, and it comes back empty."""
    return await _end(cluster, machine, lambda: cluster.machines[machine].signal(signal.SIGKILL))


async def drain(cluster: Cluster, machine: int) -> Cost:
    """Its rooms are elsewhere when it has ended."""
    return await _end(cluster, machine, lambda: cluster.terminate(machine))


async def _end(cluster: Cluster, machine: int, end: Callable[[], None]) -> Cost:
    rooms, begin = _rooms(cluster, machine), CLOCK.now()
    others, server = cluster.others(rooms, machine), cluster.servers.pop(machine)
    end()
    await cluster.until(lambda: server.poll() is not None)
    await cluster.until(lambda: rooms.keys() <= cluster.place().keys())
    cost = await cluster.cost(rooms, begin, others)
    cluster.start(machine)
    await cluster.until_joined([machine])
    return cost


def _rooms(cluster: Cluster, machine: int) -> dict[str, int]:
    """Those of a machine; what befalls none would show nothing."""
    rooms = cluster.rooms(machine)
    assert rooms, f"no room is on machine {machine}"
    return rooms


async def pause(cluster: Cluster, machine: int) -> Cost:
    """It finds itself replaced when it wakes up, and its rooms end."""
    rooms, begin = _rooms(cluster, machine), CLOCK.now()
    others = cluster.others(rooms, machine)
    cluster.machines[machine].signal(signal.SIGSTOP)
    awake = [k for k in range(3) if k != machine]
    await cluster.until(lambda: rooms.keys() <= {r for k in awake for r in cluster.rooms(k)})
    cost = await cluster.cost(rooms, begin, others)
    await asyncio.sleep(max(0.0, begin + PAUSED - CLOCK.now()))
    cluster.machines[machine].signal(signal.SIGCONT)
    await cluster.until(lambda: not any(lives(pid) for pid in rooms.values()))
    assert set(cluster.place()) == set(ROOMS)
    return cost


async def cut_off(cluster: Cluster, machine: int) -> Cost:
    """Its rooms end by themselves, before others have them."""
    rooms, begin = _rooms(cluster, machine), CLOCK.now()
    others = cluster.others(rooms, machine)
    cluster.machines[machine].plug("down")
    await cluster.until(lambda: not any(lives(pid) for pid in rooms.values()))
    await cluster.until(lambda: rooms.keys() <= cluster.place().keys())
    cost = await cluster.cost(rooms, begin, others)
    cluster.machines[machine].plug("up")
    return cost
