"""How costs grow: a tick over users and over mesh size, preparation, and the loop over its rate.

    python benchmarks/growth.py [--quick] [--picture FILE] [--json FILE]

Each cost stands beside its floor, measured in the same run:

- a tick of the balloon, 1 to 64 users: reading once the rows of C under the contacts;
- a tick of a ring of 3,000 to 550,000 tetrahedra, four users: reading once what a tick needs of
  columns and far field (`solid_ticks.py`). The contact radius is two vertex spacings on every mesh,
  so that a contact has as many vertices on each;
- preparation of those rings, from tetrahedra to the first response and the stiffness of each
  vertex: writing the factor once;
- processor time of the haptic loop at 500 to 4,000 Hz: an empty loop in C at the same priority.

Users slide at 0.2 m/s with mesh patches. The law is the exponent of a power fitted to each cost: a
tick is O(users) and does not grow with the mesh (exponent at most `LARGEST`), preparation grows
less than with its square. It is printed, with whether it holds; the exit status is 1 where it does
not.
`--picture` draws all four (it needs matplotlib, of the extra `experiments`).
"""

from __future__ import annotations

import resource
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

import json_report
import loop
import solid_ticks
import tick
from cohaptic.protocol.patch import Geometry
from cohaptic.runtime.scheduling import LOOP_PRIORITY
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.solid.shape import SolidSettings, shape_of
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.shell.column_worker import ColumnWorker
from cohaptic_server.testing.soft_ring import fixed, ring
from cohaptic_server.world.contact import locate
from growth_picture import draw
from memory import read_time
from wakeups import EmptyLoop

USERS = (1, 2, 4, 8, 16, 32, 64)
# Vertices of a ring along it and across; the last has 551,520 tetrahedra.
RINGS = ((24, 16), (40, 24), (72, 32), (112, 64), (160, 96), (320, 192))
RATES = (500.0, 1000.0, 2000.0, 4000.0)
SPEED = 0.2  # m/s
ON_RINGS = 4  # users
# Largest exponents. A tick over the mesh: trees become deeper and caches are missed more often, but
# a cost that read the mesh would have 1. Users: the coupling between them is n^2, and small.
LARGEST = {"users": 1.15, "mesh": 0.25, "preparation": 2.0, "rate": 1.15}


@dataclass(frozen=True, slots=True)
class Row:
    """One point of a curve.

    Args:
        of: Which curve: a key of `LARGEST`.
        size: Users, tetrahedra or periods a second.
        cost: Seconds, or the share of a core for the loop.
        floor: The same of what cannot be avoided.
    """

    of: str
    size: float
    cost: float
    floor: float


def over_users(ticks: int) -> list[Row]:
    """Ticks of the balloon."""
    body = Balloon()
    at = body.mesh.vertices[body.mesh.vertices[:, 0].argmax()]
    still = np.zeros_like(body.mesh.vertices)
    contact = locate(body.mesh, 0.96 * at, still, radius=body.contact_radius)
    each = 3 * body.compliance.shape[0] * body.compliance.itemsize * len(contact.vertices)
    rows: list[Row] = []
    for users in USERS:
        cost = tick.run(body, users, ticks, SPEED, Geometry.MESH)["tick"]
        rows.append(_say(Row("users", users, cost, read_time(users * each))))
    return rows


def over_meshes(sizes: int, ticks: int) -> list[Row]:
    """Ticks and preparation of rings, the coarsest first."""
    rows: list[Row] = []
    for shape in RINGS[:sizes]:
        mesh = ring(*shape)
        held = fixed(mesh)
        spacing = shape_of(mesh, held, SolidSettings(order=1)).mesh.spacing()
        start = time.perf_counter()
        body = Solid(mesh, held, SolidSettings(order=1, contact_radius=2.0 * spacing), name="ring")
        body.respond([])
        body.vertex_compliance()
        prepared, count = time.perf_counter() - start, len(mesh.tets)
        floor = _write_time(round(body.factor_bytes))
        rows.append(_say(Row("preparation", count, prepared, floor)))
        worker = ColumnWorker(body)
        worker.start()
        try:
            seen = solid_ticks.measure(body, worker, ON_RINGS, ticks, speed=SPEED)
        finally:
            worker.stop()
        rows.append(_say(Row("mesh", count, seen.median, seen.floor)))
    return rows


def over_rates(seconds: float) -> list[Row]:
    """Processor time of the loop with a simulated hand, as a share of a core."""
    rows: list[Row] = []
    empty = EmptyLoop()
    for hz in RATES:
        figures, scheduling = loop.haptic_loop(hz, seconds)
        priority = LOOP_PRIORITY if "SCHED_FIFO" in scheduling else 0
        bare = loop.of_wakeups(empty.run(hz, seconds, priority))["cpu"]
        cpu = figures["cpu"]
        if cpu is None or bare is None:
            print("no processor times here: the loop over its rate is left out", file=sys.stderr)
            break
        rows.append(_say(Row("rate", hz, cpu, bare)))
    empty.close()
    return rows


def _write_time(count: int) -> float:
    """Least time to write `count` bytes once [s]."""
    values = np.empty(max(1, count // 4), dtype=np.float32)
    best = np.inf
    for _ in range(3):
        start = time.perf_counter()
        values.fill(1.0)
        best = min(best, time.perf_counter() - start)
    return float(best)


def exponent(rows: list[Row]) -> float:
    """Exponent of the power of the size that fits the costs best."""
    size, cost = np.log([row.size for row in rows]), np.log([row.cost for row in rows])
    return float(np.polyfit(size, cost, 1)[0])


def _say(row: Row) -> Row:
    unit, scale = ("% of a core", 100.0) if row.of == "rate" else ("ms", 1e3)
    cells = (f"{scale * value:.4g} {unit}" for value in (row.cost, row.floor))
    print(f"| {row.of} | {row.size:.0f} | {' | '.join(cells)} |", flush=True)
    return row


def main() -> None:
    """Print a table and the laws; draw them if asked."""
    parser = json_report.parser(__doc__)
    parser.add_argument(
        "--quick", action="store_true", help="small meshes and few ticks, to try it"
    )
    parser.add_argument("--picture", type=Path, default=None, help="a .png or .svg to draw")
    options = parser.parse_args()
    print("| over | size | cost | floor |\n|---|---|---|---|")
    rows = over_rates(1.0 if options.quick else 4.0)
    with threadpool_limits(limits=1):
        rows += over_users(60 if options.quick else 300)
        rows += over_meshes(3 if options.quick else len(RINGS), 60 if options.quick else 300)
    laws: list[json_report.Result] = []
    for name, limit in LARGEST.items():
        # The first few users also carry what a tick costs whoever is there.
        curve = [row for row in rows if row.of == name and not (name == "users" and row.size < 4)]
        if len(curve) > 1:
            power = exponent(curve)
            laws.append({"law": name, "exponent": power, "most": limit, "holds": power <= limit})
            word = "holds" if power <= limit else "DOES NOT HOLD"
            print(f"{name}: cost ~ size^{power:.2f}, at most {limit:g}: {word}")
        else:
            print(f"{name}: not measured here")
    peak = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"peak memory {1e-9 * peak:.1f} GB")
    points: list[json_report.Result] = [
        {"over": r.of, "size": r.size, "cost": r.cost, "floor": r.floor} for r in rows
    ]
    json_report.write(options, [*points, *laws, {"peak_bytes": peak}])
    if options.picture is not None:
        draw(points, options.picture)
    sys.exit(not all(law["holds"] for law in laws))


if __name__ == "__main__":
    main()
