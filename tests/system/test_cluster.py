"""Rooms on three machines: what fails costs its own users a moment, and nobody else anything."""

from __future__ import annotations

import asyncio
import importlib.util
from pathlib import Path

import pytest

from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_tools.demo.analysis import Recording
from cohaptic_tools.demo.processes import Process
from tests.system import failures, test_rooms
from tests.system.cluster import PORT, ROOMS, Cluster
from tests.system.namespaces import machines

pytestmark = [
    pytest.mark.alone,
    pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="the extra cluster"),
]


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
        costs = [
            await failures.kill_room(cluster, room, killed),
            await failures.kill_machine(cluster, killed),
            await failures.drain(cluster, cluster.fullest((1, 2))),
            await failures.pause(cluster, cluster.fullest((1, 2))),
            await failures.cut_off(cluster, cluster.fullest((1, 2))),
            await failures.lose_head(cluster),
            await failures.kill_machine(cluster, 0),  # with the head
        ]
        # No other hand has lost its connection.
        assert [cost.lost for cost in costs] == [0] * len(costs)


def _touch(cluster: Cluster, room: str, name: str, folder: Path) -> Process:
    url = f"ws://{cluster.machines[0].address}:{PORT}/r/{room}"
    return Process(
        "touch", url, "--name", name, "--wait", "60", "--geometry", "plane",
        "--record", str(folder / f"{name}.npz"), "--json-lines", log=folder / f"{name}.log",
    )  # fmt: skip
