"""Cost of spectators to the server, and their effect on the punctuality of patches.

    python benchmarks/spectators.py [--spectators 50] [--rate 30] [--seconds 4] [--rounds 4]
        [--json FILE]

First the parts: time to encode a scene of a balloon in motion, and its size. Then a real server
with two users who press and slide, over loopback. Phases with and without spectators alternate in
one run. Users and spectators have a process each (`spectator_processes.py`), so that none shares an
event loop with the server. The users record when each patch arrives; its time stamp is that of its
tick, on the same clock. Timings depend on the machine and its load; compare within one run.
"""

from __future__ import annotations

import argparse
import asyncio
import functools
import multiprocessing
import sys
import time

import numpy as np
from threadpoolctl import threadpool_limits

import json_report
from cohaptic.control.law import Law
from cohaptic.protocol.traversal import Traversal
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.green import Superposition, encode_block
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.room.watch.scene_broadcast import SceneEncoder, displacement, records
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.server import CohapticServer
from cohaptic_server.world.state import Participant, Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState
from spectator_processes import PERIOD, Lateness, hand, hands, spectators

WARM_UP = 1.0  # s at the start of a phase that are not counted


def parts(body: Balloon) -> list[json_report.Result]:
    """Measure and print the parts of serving spectators, with two users in motion."""
    n = len(body.mesh.vertices)
    encoder = SceneEncoder(Traversal.of(n, body.mesh.faces), follows_records=True)
    source, world = Superposition(body), WorldState()
    see, full, light, sizes, block = (list[float]() for _ in range(5))
    sizes_light = list[int]()
    for tick in range(1, 301):
        touches = [
            Touch(
                Participant(user + 1, Law.PREDICTIVE, 1000.0, 10.0),
                *hand(tick, user),
                tick,
                tick - 1,
                0.0,
                0.0,
            )
            for user in range(2)
        ]
        world, patches = advance(TouchedBody(body), world, touches, now=tick * PERIOD, dt=PERIOD)
        shape = displacement(world, n)
        start = time.perf_counter()
        encoder.see(tick, 0.0, records(world, patches), functools.partial(np.asarray, shape))
        see.append(time.perf_counter() - start)
        start = time.perf_counter()
        sizes.append(len(encoder.frame(surface=True)))
        full.append(time.perf_counter() - start)
        start = time.perf_counter()
        sizes_light.append(len(encoder.frame(surface=False)))
        light.append(time.perf_counter() - start)
        start = time.perf_counter()
        encode_block(source.green(tick))
        block.append(time.perf_counter() - start)
    print(f"\n{n} vertices, two users, {len(see)} ticks\n")
    print("| | median | 99th percentile |\n|---|---|---|")
    print(
        f"| frame with the surface | {np.median(sizes):.0f} B | {np.quantile(sizes, 0.99):.0f} B |"
    )
    results: list[json_report.Result] = [
        {"part": "frame with the surface", "p50_bytes": float(np.median(sizes))},
        {"part": "frame of forces", "p50_bytes": float(np.median(sizes_light))},
    ]
    print(f"| frame of forces | {np.median(sizes_light):.0f} B | {max(sizes_light)} B |")
    for name, values in (
        ("records, and whether they are news", see),
        ("encode with the surface", full),
        ("encode forces", light),
        ("a block of Green's functions", block),
    ):
        low, high = 1e3 * np.median(values), 1e3 * np.quantile(values, 0.99)
        print(f"| {name} | {low:.3f} ms | {high:.3f} ms |")
        results.append({"part": name, "p50_s": 1e-3 * float(low), "p99_s": 1e-3 * float(high)})
    return results


async def race(body: Balloon, options: argparse.Namespace) -> list[json_report.Result]:
    """Alternate phases without and with spectators, and print both."""
    server = CohapticServer(body, ServerSettings(port=0))
    url = await server.start()
    serving = asyncio.ensure_future(server.run())
    context = multiprocessing.get_context("spawn")
    go, ready, end = context.Event(), context.Event(), context.Event()
    watchers = context.Process(
        target=spectators,
        args=(url, options.spectators, options.rate, options.encoding, go, ready, end),
    )
    watchers.start()
    ours, theirs = context.Pipe()
    touchers = context.Process(target=hands, args=(url, server.clock.origin, theirs))
    touchers.start()
    theirs.close()
    noted: dict[bool, list[Lateness]] = {False: [], True: []}
    busy = {False: 0.0, True: 0.0}
    while len(server.room.members) < 2:
        await asyncio.sleep(0.05)
    for phase in range(2 * options.rounds):
        watched = phase % 2 == 1
        if watched:
            go.set()
            while not ready.is_set():
                await asyncio.sleep(0.02)
        await asyncio.sleep(WARM_UP)
        ours.send(True)
        busy[watched] -= time.process_time()
        await asyncio.sleep(options.seconds)
        busy[watched] += time.process_time()
        ours.send(False)
        while not ours.poll():
            await asyncio.sleep(0.01)
        noted[watched] += ours.recv()
        go.clear()
        ready.clear()
        await asyncio.sleep(0.3)
    end.set()
    ours.close()
    serving.cancel()
    await asyncio.gather(serving, return_exceptions=True)
    watchers.join(10.0)
    touchers.join(10.0)
    results = report(noted, server)
    idle, full = (busy[watched] / (options.rounds * options.seconds) for watched in (False, True))
    print(f"the server was busy {idle:.0%} of the time, with spectators {full:.0%}")
    return [*results, {"busy_without": idle, "busy_with_spectators": full}]


def report(noted: dict[bool, list[Lateness]], server: CohapticServer) -> list[json_report.Result]:
    """Print the lateness of patches with and without spectators."""
    results: list[json_report.Result] = []
    print("\n| | after its tick p50 | p99 | off its time p50 | p99 | patches |")
    print("|---|---|---|---|---|---|")
    worst: dict[bool, float] = {}
    for watched, name in ((False, "nobody watches"), (True, "spectators")):
        late = np.concatenate([mine.patches for mine in noted[watched]])
        gaps = np.concatenate([mine.gaps for mine in noted[watched]])
        worst[watched] = float(np.quantile(gaps, 0.99))
        after = float(np.quantile(late, 0.99))
        print(
            f"| {name} | {1e3 * np.median(late):.2f} ms | {1e3 * after:.2f} ms"
            f" | {1e3 * np.median(gaps):.2f} ms | {1e3 * worst[watched]:.2f} ms | {len(late)} |"
        )
        results.append(
            {
                "phase": name,
                "after_tick_p50_s": float(np.median(late)),
                "after_tick_p99_s": after,
                "off_its_time_p50_s": float(np.median(gaps)),
                "off_its_time_p99_s": worst[watched],
                "patches": len(late),
            }
        )
    print(
        f"\noff its time, 99th percentile: {1e3 * (worst[True] - worst[False]):+.2f} ms with"
        f" spectators, {worst[True] / worst[False]:.2f} times"
        f"\na tick took {1e3 * server.meters.cost.quantile(0.5):.2f} ms in the median, those who"
        f" watched {1e3 * server.meters.watch_cost.quantile(0.5):.2f} ms more"
    )
    results.append(
        {
            "off_its_time_p99_with_over_without": worst[True] / worst[False],
            "tick_p50_s": server.meters.cost.quantile(0.5),
            "watch_p50_s": server.meters.watch_cost.quantile(0.5),
        }
    )
    return results


def main() -> None:
    """Print tables."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--spectators", type=int, default=50)
    parser.add_argument("--rate", type=float, default=30.0, help="frames per second")
    parser.add_argument("--encoding", choices=("frames", "forces"), default="frames")
    parser.add_argument("--seconds", type=float, default=4.0, help="of a phase that count")
    parser.add_argument("--rounds", type=int, default=4, help="phases of each kind")
    parser.add_argument("--subdivisions", type=int, default=4, help="4 gives 2,562 vertices")
    options = parser.parse_args()
    sys.setswitchinterval(5e-4)
    print("building the balloon", file=sys.stderr)
    body = Balloon(BalloonSettings(subdivisions=options.subdivisions))
    with threadpool_limits(limits=1):
        results = [*parts(body), *asyncio.run(race(body, options))]
    json_report.write(options, results)


if __name__ == "__main__":
    main()
