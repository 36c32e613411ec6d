"""Cost of a tick of the server over the number of users, and the shares of its parts.

    python benchmarks/tick.py [--ticks 300] [--speed 0.2] [--geometry mesh] [--solids 5 20 137]
        [--flex FOLDER] [--json FILE]

Users press 4 mm into the balloon round its equator and slide to and fro over 8 cm of it, so that
every contact moves in every tick. The first ticks (`warm_up`) do not count. `locate` finds them,
`respond` is the body, `rest` is patches and gains, `frames` decodes a sample and encodes a patch
for each user. Everything is measured in one run, with one BLAS thread as on the server; the last
column is the share of a 60 Hz period. The second table is of the balloon under finite deformation.

With `--solids`, a table over mesh size: ticks by the clock, how many took longer than their period,
and beside them the floor, the time to read once what a tick needs (`solid_ticks.py`). `--flex`
adds MuJoCo's step of 1/60 s on the same tetrahedra under as many balls (`flex.py`); its compiled
models are kept in FOLDER.
"""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

import json_report
import solid_ticks
from big_mesh import SIZES
from cohaptic.control.law import Law
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.patch import Geometry
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.world.contact import Contact, locate
from cohaptic_server.world.state import Participant, Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState

PERIOD = 1.0 / 60.0  # s
SLIDE = 0.08  # m to and fro
WARM_UP = 20  # ticks that do not count: first contacts, first columns, cold caches


def touches(users: int, tick: int, speed: float, geometry: Geometry) -> list[Touch]:
    """Everybody presses 1 N and slides along the equator at a constant speed, to and fro."""
    made: list[Touch] = []
    for user in range(users):
        way = (speed * tick * PERIOD + 0.03 * user) % (2.0 * SLIDE)
        angle = 2.0 * math.pi * user / users + abs(way - SLIDE) / 0.1
        out = (math.cos(angle), math.sin(angle), 0.0)
        made.append(
            Touch(
                who=Participant(
                    user=user + 1,
                    law=Law.PREDICTIVE,
                    max_stiffness=1000.0,
                    max_force=10.0,
                    geometry=geometry,
                ),
                probe=(0.096 * out[0], 0.096 * out[1], 0.0),
                force=out,
                seq=tick + 1,
                tick=max(0, tick - 1),
                t_client=tick * PERIOD,
                arrived=0.0,
            )
        )
    return made


def run(body: Body, users: int, ticks: int, speed: float, geometry: Geometry) -> dict[str, float]:
    """Median seconds per tick, whole and by part."""
    state, touched_body = WorldState(), TouchedBody(body)
    whole, parts = list[float](), {"locate": list[float](), "respond": [], "frames": []}
    for tick in range(WARM_UP + ticks):
        now = touches(users, tick, speed, geometry)
        start = time.perf_counter()
        before = state
        state, patches = advance(touched_body, state, now, now=tick * PERIOD, dt=PERIOD)
        whole.append(time.perf_counter() - start)

        start = time.perf_counter()
        for user in now:
            ContactSample.decode(
                ContactSample(user.seq, tick, 0.0, user.probe, user.force).encode()
            )
        for patch in patches.values():
            patch.encode()
        parts["frames"].append(time.perf_counter() - start)

        if before.response is not None:
            contacts: list[Contact] = []
            start = time.perf_counter()
            for user in now:
                old = before.users[user.user]
                free = old.free
                assert free is not None
                probe = np.array(user.probe)
                contacts.append(
                    locate(body.mesh, probe, free, radius=body.contact_radius, hint=old.contact)
                )
            parts["locate"].append(time.perf_counter() - start)
            start = time.perf_counter()
            body.respond([contact.load(1.0) for contact in contacts], before.response)
            parts["respond"].append(time.perf_counter() - start)
    medians = {name: float(np.median(values[WARM_UP:])) for name, values in parts.items()}
    whole = whole[WARM_UP:]
    return medians | {
        "tick": float(np.median(whole)),
        "p99": float(np.quantile(whole, 0.99)),
    }


def main() -> None:
    """Print a table."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--ticks", type=int, default=300, help="of each row")
    parser.add_argument("--solids", type=int, nargs="*", default=[], choices=SIZES)
    parser.add_argument("--speed", type=float, default=0.2, help="of sliding, in m/s")
    parser.add_argument("--geometry", choices=("plane", "sphere", "mesh"), default="mesh")
    parser.add_argument("--flex", type=Path, default=None, help="folder of MuJoCo's models")
    options = parser.parse_args()
    if options.solids:
        with threadpool_limits(limits=1):
            results = solid_ticks.table(
                options.solids,
                options.ticks,
                speed=options.speed,
                models=options.flex,
            )
    else:
        results = [
            row
            for body in (Balloon(), RubberBalloon())
            for row in table(body, options.ticks, options.speed, Geometry[options.geometry.upper()])
        ]
    json_report.write(options, results)


def table(body: Body, ticks: int, speed: float, geometry: Geometry) -> list[json_report.Result]:
    """Measure one body, and print its rows."""
    results: list[json_report.Result] = []
    print(f"\n{type(body).__name__}, {len(body.mesh.vertices)} vertices\n")
    print(
        "| users | tick p50 | tick p99 | locate | respond | rest | frames | per user | of 60 Hz |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    with threadpool_limits(limits=1):
        for users in (1, 2, 4, 8, 16):
            t = run(body, users, ticks, speed, geometry)
            rest = t["tick"] - t["locate"] - t["respond"]
            print(
                f"| {users} | {1e3 * t['tick']:.2f} ms | {1e3 * t['p99']:.2f} ms"
                f" | {t['locate'] / t['tick']:.0%} | {t['respond'] / t['tick']:.0%}"
                f" | {rest / t['tick']:.0%} | +{t['frames'] / t['tick']:.0%}"
                f" | {1e3 * t['tick'] / users:.2f} ms | {t['tick'] / PERIOD:.0%} |"
            )
            results.append(
                {
                    "body": type(body).__name__,
                    "users": users,
                    "speed_m_per_s": speed,
                    "geometry": geometry.name.lower(),
                    "warm_up_ticks": WARM_UP,
                    "tick_p50_s": t["tick"],
                    "tick_p99_s": t["p99"],
                    "locate": t["locate"] / t["tick"],
                    "respond": t["respond"] / t["tick"],
                    "rest": rest / t["tick"],
                    "frames": t["frames"] / t["tick"],
                }
            )
    return results


if __name__ == "__main__":
    main()
