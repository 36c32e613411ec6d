"""Rooms on three machines: what it costs to come in through another, and how late their ticks are.

    PYTHONPATH=. python benchmarks/cluster.py [--seconds S] [--failures] [--json FILE]

The machines are network namespaces of this one, which need Linux, iproute2, the rights of root and
the extra cluster. Twelve rooms have three hands each, and a plain server beside them, without any
engine, has four rooms with three hands. In the same run are measured

- round trips of pings to one room through its own machine and through another, in turns, before
  the hands come and while they press, where three machines share the cores of one;
- by how much the intervals between patches differ from the period, in rooms of the cluster whose
  hands come in through their machine, in those through another, and in those of the plain server;
- memory and processors of each machine;
- with `--failures` (4 minutes) for how long hands have no touch after what befalls a machine.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import json_report
from tests.server.shell.stage import visit
from tests.system import failures
from tests.system.cluster import CLOCK, RATE, ROOMS, Cluster, Hand
from tests.system.namespaces import machines

_PLAIN = 8799  # port of the plain server
_PLAIN_ROOMS = ROOMS[:4]
_PINGS = 25  # a second of each kind; a room allows twice its rate of reads


def quantiles(seconds: Sequence[float]) -> dict[str, float]:
    """The median and the 99 % quantile of times [ms]."""
    ordered = sorted(seconds)
    return {
        "median": round(1e3 * ordered[len(ordered) // 2], 3),
        "p99": round(1e3 * ordered[int(0.99 * (len(ordered) - 1))], 3),
    }


async def pings(urls: Sequence[str], seconds: float) -> list[list[float]]:
    """Round trips through each of these addresses, in turns [s]."""
    found: list[list[float]] = [[] for _ in urls]
    async with contextlib.AsyncExitStack() as stack:
        clients = [await stack.enter_async_context(visit(url, patience=1e6)) for url in urls]
        for k, client in enumerate(clients):
            await client.join(f"ping{k}")
        reading = [asyncio.ensure_future(one.end()) for one in clients]
        end = CLOCK.now() + seconds
        while CLOCK.now() < end:
            for times, client in zip(found, clients, strict=True):
                begin = CLOCK.now()
                await (await client.ws.ping())
                times.append(CLOCK.now() - begin)
                await asyncio.sleep(1.0 / _PINGS / len(urls))
        for task in reading:
            task.cancel()
        await asyncio.gather(*reading, return_exceptions=True)
    return found


def report(when: str, found: Sequence[list[float]], owner: int) -> dict[str, object]:
    """Round trips through the room's machine and through the others."""
    others = [time for k, times in enumerate(found) if k != owner for time in times]
    return {
        f"round trip {when}, through the room's machine [ms]": quantiles(found[owner]),
        f"round trip {when}, through another [ms]": quantiles(others),
    }


def unevenness(hands: Sequence[Hand], begin: float) -> list[float]:
    """By how much intervals between patches differ from the period, of all hands [s]."""
    found = list[float]()
    for hand in hands:
        times = [at for at in hand.patches if at > begin]
        found += [abs(b - a - 1.0 / RATE) for a, b in pairwise(times)]
    return found


async def befall(cluster: Cluster) -> dict[str, object]:
    """How long hands are without touch: those of lost rooms, and the others."""
    killed = cluster.fullest((1, 2))
    room = next(iter(cluster.rooms(killed)))
    costs = {
        "process of a room": await failures.kill_room(cluster, room, killed),
        "machine killed": await failures.kill_machine(cluster, killed),
        "machine told to end": await failures.drain(cluster, cluster.fullest((1, 2))),
        "machine paused": await failures.pause(cluster, cluster.fullest((1, 2))),
        "machine cut off": await failures.cut_off(cluster, cluster.fullest((1, 2))),
        "head for a minute": await failures.lose_head(cluster),
        "machine of the head killed": await failures.kill_machine(cluster, 0),
    }
    return {
        f"{what}: longest silence of its hands, of the others [s]; connections that these lost": (
            round(max(cost.silent, default=0.0), 2),
            round(max(cost.others, default=0.0), 2),
            cost.lost,
        )
        for what, cost in costs.items()
    }  # fmt: skip


async def measure(cluster: Cluster, seconds: float, *, failing: bool) -> dict[str, object]:
    """Everything that the benchmark tells."""
    await cluster.until_joined(range(3))
    room = ROOMS[0]
    calm = await pings([f"{url}/r/{room}" for url in cluster.urls], seconds)
    owner = next(iter(cluster.place().values()))
    plain = [
        Hand(room, f"plain{k}-{j}", 0, [f"ws://127.0.0.1:{_PLAIN}"])
        for k, room in enumerate(_PLAIN_ROOMS)
        for j in range(3)
    ]
    living = [asyncio.ensure_future(hand.live()) for hand in plain]
    async with cluster.with_hands():
        await cluster.until(lambda: all(hand.touches for hand in plain))
        place, begin = cluster.place(), CLOCK.now()
        used = [one.processor() for one in cluster.machines]
        await asyncio.sleep(seconds)
        cores = [
            (one.processor() - before) / (CLOCK.now() - begin)
            for one, before in zip(cluster.machines, used, strict=True)
        ]
        own = [hand for hand in cluster.hands if place[hand.room] == hand.through]
        passed = [hand for hand in cluster.hands if place[hand.room] != hand.through]
        late = {
            "through their machine": unevenness(own, begin),
            "through another": unevenness(passed, begin),
            "plain server": unevenness(plain, begin),
        }
        busy = await pings([f"{url}/r/{room}" for url in cluster.urls], seconds)
        memory = [one.memory() for one in cluster.machines]
        for task in living:
            task.cancel()
        await asyncio.gather(*living, return_exceptions=True)
        befallen = await befall(cluster) if failing else {}
    return befallen | {
        **report("before hands come", calm, owner),
        **report("while they press", busy, owner),
        **{f"unevenness of patches, {what} [ms]": quantiles(t) for what, t in late.items()},
        "processors of each machine": [round(one, 3) for one in cores],
        "memory of each machine [MB]": [round(one) for one in memory],
    }


def main() -> None:
    """Entry point."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--seconds", type=float, default=30.0, help="of each measurement")
    parser.add_argument("--failures", action="store_true", help="also lose rooms and machines")
    a = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, machines(3, Path(name)) as there:
        config = Path(name) / "plain.toml"
        rooms = "".join(f'[rooms.{r}]\nbody = "balloon"\nrate = {RATE}\n' for r in _PLAIN_ROOMS)
        config.write_text(f"port = {_PLAIN}\n{rooms}")
        command = [sys.executable, "-m", "cohaptic", "serve", "--config", str(config), "--quiet"]
        plain = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        try:
            with Cluster(there, Path(name), in_each=3) as cluster:
                found = asyncio.run(measure(cluster, a.seconds, failing=a.failures))
        finally:
            plain.terminate()
            plain.wait()
    print(json.dumps(found, indent=1))
    json_report.write(a, [{"measured": k, "found": json.dumps(v)} for k, v in found.items()])


if __name__ == "__main__":
    main()
