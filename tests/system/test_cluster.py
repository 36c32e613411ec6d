"""Rooms on three machines: what fails costs its own users a moment, and nobody else anything."""

from __future__ import annotations

import asyncio
import importlib.util
import os
import signal
from pathlib import Path

import pytest

from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_tools.demo.analysis import Recording
from cohaptic_tools.demo.processes import Process
from tests.system import test_rooms
from tests.system.cluster import CLOCK, PORT, ROOMS, Cluster, lives
from tests.system.namespaces import machines

pytestmark = [
    pytest.mark.alone,
    pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="the extra cluster"),
]

AWAY = 60.0  # s for which the head is gone
PAUSED = 6.0  # s; longer than a lease


@pytest.mark.timeout(900)
def test_what_fails_costs_its_own_users_a_moment(tmp_path: Path) -> None:
    with machines(3, tmp_path) as there, Cluster(there, tmp_path) as cluster:
        touching: list[Process] = []
        try:
            asyncio.run(_befall(cluster, touching, tmp_path))
        finally:
            for hand in touching:
                hand.wait()
        for name in ("left", "right"):
            recorded = Recording.load(tmp_path / f"{name}.npz").columns
            largest = test_rooms.largest_unexplained(recorded, recorded["t"][0])
            assert largest <= EXTERNAL_RATE * test_rooms.STEP_TIME
        for k in range(3):
            assert "Traceback" not in cluster.log(k).read_text()


async def _befall(cluster: Cluster, touching: list[Process], folder: Path) -> None:
    await cluster.until_joined(range(3))
    async with cluster.with_hands():
        assert set(cluster.place()) == set(ROOMS)
        assert len(set(cluster.place().values())) > 1
        # Two real clients, in a room of the machine that is killed; they come through the first.
        killed = cluster.fullest((1, 2))
        room = next(iter(cluster.rooms(killed)))
        touching += [_touch(cluster, room, name, folder) for name in ("left", "right")]
        await cluster.until(lambda: all(test_rooms.state(hand)[1] > 1.0 for hand in touching))
        await _kill_room(cluster, room, killed)
        await _lose_head(cluster)
        await _kill_machine(cluster, killed)
        await _drain(cluster, cluster.fullest((1, 2)))
        await _pause(cluster, cluster.fullest((1, 2)))
        await _cut_off(cluster, cluster.fullest((1, 2)))


def _touch(cluster: Cluster, room: str, name: str, folder: Path) -> Process:
    url = f"ws://{cluster.machines[0].address}:{PORT}/r/{room}"
    return Process(
        "touch", url, "--name", name, "--wait", "60", "--geometry", "plane",
        "--record", str(folder / f"{name}.npz"), "--json-lines", log=folder / f"{name}.log",
    )  # fmt: skip


async def _kill_room(cluster: Cluster, room: str, machine: int) -> None:
    """It comes back on its machine, and no other hand loses its connection."""
    pid, others, begin = cluster.rooms(machine)[room], cluster.others([room]), CLOCK.now()
    os.kill(pid, signal.SIGKILL)
    await cluster.until(lambda: cluster.rooms(machine).get(room, pid) != pid)
    assert (await cluster.cost([room], begin, others)).lost == 0


async def _lose_head(cluster: Cluster) -> None:
    """For a minute, after which it remembers nothing: nobody notices, and no room moves."""
    before, begin = cluster.place(), CLOCK.now()
    while CLOCK.now() < begin + AWAY:
        cluster.end_head()
        await asyncio.sleep(0.2)
    await cluster.until_joined([0])
    await asyncio.sleep(10.0)  # the others come back to the new head
    assert (await cluster.cost([], begin, cluster.hands)).lost == 0
    assert cluster.place() == before


async def _kill_machine(cluster: Cluster, machine: int) -> None:
    """Its rooms are on others, and it comes back empty."""
    rooms, begin = cluster.rooms(machine), CLOCK.now()
    others = cluster.others(rooms, machine)
    cluster.machines[machine].signal(signal.SIGKILL)
    cluster.servers.pop(machine).wait()
    await cluster.until(lambda: rooms.keys() <= cluster.place().keys())
    assert (await cluster.cost(rooms, begin, others)).lost == 0
    cluster.start(machine)
    await cluster.until_joined([machine])


async def _drain(cluster: Cluster, machine: int) -> None:
    """Its rooms are elsewhere when it has ended."""
    rooms, begin = cluster.rooms(machine), CLOCK.now()
    others = cluster.others(rooms, machine)
    cluster.servers[machine].send_signal(signal.SIGTERM)
    await cluster.until(lambda: cluster.servers[machine].poll() is not None)
    await cluster.until(lambda: rooms.keys() <= cluster.place().keys())
    assert (await cluster.cost(rooms, begin, others)).lost == 0
    cluster.start(machine)
    await cluster.until_joined([machine])


async def _pause(cluster: Cluster, machine: int) -> None:
    """It finds itself replaced when it wakes up, and its rooms end."""
    rooms, begin = cluster.rooms(machine), CLOCK.now()
    cluster.machines[machine].signal(signal.SIGSTOP)
    awake = [k for k in range(3) if k != machine]
    await cluster.until(lambda: rooms.keys() <= {r for k in awake for r in cluster.rooms(k)})
    await asyncio.sleep(max(0.0, begin + PAUSED - CLOCK.now()))
    cluster.machines[machine].signal(signal.SIGCONT)
    await cluster.until(lambda: not any(lives(pid) for pid in rooms.values()))
    assert set(cluster.place()) == set(ROOMS)


async def _cut_off(cluster: Cluster, machine: int) -> None:
    """Its rooms end by themselves, before others have them."""
    rooms = cluster.rooms(machine)
    cluster.machines[machine].plug("down")
    await cluster.until(lambda: not any(lives(pid) for pid in rooms.values()))
    await cluster.until(lambda: rooms.keys() <= cluster.place().keys())
    cluster.machines[machine].plug("up")
    await cluster.until_all_touch()
