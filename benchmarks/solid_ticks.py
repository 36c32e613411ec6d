"""Ticks of a solid over mesh size and users, in real time, beside a lower bound of their cost.

Hands slide to and fro on a ring (`big_mesh.py`), so that vertices are newly touched all the time.
Ticks start at 60 Hz by the clock and not back to back, so that the column worker gets the time
between them that it would get on a server.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import json_report
from big_mesh import SIZES, solid
from cohaptic.control.law import Law
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.shell.column_worker import ColumnWorker
from cohaptic_server.testing.soft_ring import RING, TUBE, ring
from cohaptic_server.world.state import Touch, WorldState
from cohaptic_server.world.tick import advance
from flex import DEPTH, TooLarge, compiled, step
from memory import read_time

PERIOD = 1.0 / 60.0  # s
_WAY = 0.01  # m; to both sides


@dataclass(frozen=True, slots=True)
class Ticks:
    """Costs of ticks.

    Args:
        median: Of a tick [s].
        p99: 99th percentile [s].
        missed: Share of ticks that took more than a period.
        floor: Time to read once the part of the columns that the last tick needed [s].
    """

    median: float
    p99: float
    missed: float
    floor: float


@contextmanager
def served(thousands: int) -> Generator[tuple[Solid, ColumnWorker]]:
    """A ring with its column worker, as on a running server."""
    body = solid(thousands)
    worker = ColumnWorker(body)
    worker.start()
    try:
        yield body, worker
    finally:
        worker.stop()


def hands(users: int, tick: int, speed: float) -> list[Touch]:
    """Everybody presses 1 N on the top of the ring and slides at `speed` [m/s]."""
    touches: list[Touch] = []
    for user in range(users):
        # A triangle wave: to and fro without a rest.
        turn = 4.0 * _WAY / speed
        phase = (tick * PERIOD / turn + user / users) % 1.0
        off = _WAY * (4.0 * abs(phase - 0.5) - 1.0)
        angle = 2.0 * math.pi * user / users + off / RING
        place = (RING * math.cos(angle), RING * math.sin(angle), TUBE - DEPTH)
        touches.append(
            Touch(
                user=user + 1,
                law=Law.PREDICTIVE,
                max_stiffness=1000.0,
                max_force=10.0,
                probe=place,
                force=(0.0, 0.0, 1.0),
                seq=tick + 1,
                tick=tick,
                t_client=0.0,
                arrived=0.0,
            )
        )
    return touches


def measure(
    body: Solid, worker: ColumnWorker, users: int, ticks: int, *, speed: float, reach: float
) -> Ticks:
    """Run ticks by the clock, the first second not counted.

    Args:
        body: The solid.
        worker: Computes its columns.
        users: How many touch it.
        ticks: How many are measured.
        speed: At which hands slide [m/s].
        reach: How far from a contact a tick needs its columns [m]; infinite for all of them.
    """
    state, times, due = WorldState(), list[float](), time.perf_counter()
    for tick in range(60 + ticks):
        time.sleep(max(0.0, due - time.perf_counter()))
        due = max(due + PERIOD, time.perf_counter())
        now = hands(users, tick, speed)
        start = time.perf_counter()
        worker.pump()
        state, _ = advance(TouchedBody(body), state, now, now=tick * PERIOD, dt=PERIOD)
        times.append(time.perf_counter() - start)
    counted = np.array(times[60:])
    return Ticks(
        float(np.median(counted)),
        float(np.quantile(counted, 0.99)),
        float(np.mean(counted > PERIOD)),
        read_time(_needed(body, state, reach)),
    )


def _needed(body: Solid, state: WorldState, reach: float) -> int:
    """Bytes of the columns under the present contacts, as far as `reach` from each, once each."""
    rows: dict[int, npt.NDArray[np.bool_]] = {}
    x = body.mesh.vertices
    for user in state.users.values():
        near = np.linalg.norm(x - user.contact.point, axis=1) <= reach
        for vertex in user.contact.vertices.tolist():
            rows[vertex] = rows.get(vertex, np.zeros(len(x), dtype=np.bool_)) | near
    share = sum(int(near.sum()) for near in rows.values()) / len(x)
    return round(share * body.columns.store.column_bytes)


def _model(thousands: int, body: Solid, models: Path | None) -> Any:
    """MuJoCo's model of a ring; None if not requested or too large."""
    try:
        return compiled(thousands, body, models) if models is not None else None
    except TooLarge as error:
        print(f"  {error}", file=sys.stderr)
        return None


def table(
    sizes: list[int], ticks: int, *, speed: float, reach: float, models: Path | None = None
) -> list[json_report.Result]:
    """Print the rows of all sizes, with MuJoCo's flex if there is a folder for its models.

    Args:
        sizes: Thousands of tetrahedra, keys of `SIZES`.
        ticks: Of each row.
        speed: At which hands slide [m/s].
        reach: How far from a contact a tick needs its columns [m]; infinite for all of them.
        models: Folder of compiled models.

    Returns:
        The rows.
    """
    results: list[json_report.Result] = []
    print(f"\nSolids; hands slide at {speed:g} m/s\n")
    print("| tetrahedra | surface | users | tick p50 | p99 | missed | floor | over it | flex |")
    print("|---|---|---|---|---|---|---|---|---|")
    for thousands in sizes:
        count = len(ring(*SIZES[thousands]).tets)
        with served(thousands) as (body, worker):
            model = _model(thousands, body, models)
            for users in (1, 2, 4, 8):
                t = measure(body, worker, users, ticks, speed=speed, reach=reach)
                flex = None if model is None else step(model, users, 20).median
                beside = "" if flex is None else f"{1e3 * flex:.0f} ms"
                results.append(
                    {
                        "tetrahedra": count,
                        "surface_vertices": len(body.mesh.vertices),
                        "users": users,
                        "tick_p50_s": t.median,
                        "tick_p99_s": t.p99,
                        "missed": t.missed,
                        "floor_s": t.floor,
                        "tick_over_floor": t.median / t.floor,
                        "flex_step_p50_s": flex,
                    }
                )
                print(
                    f"| {count} | {len(body.mesh.vertices)} | {users}"
                    f" | {1e3 * t.median:.2f} ms | {1e3 * t.p99:.2f} ms | {t.missed:.1%}"
                    f" | {1e3 * t.floor:.2f} ms | {t.median / t.floor:.1f} | {beside} |",
                    flush=True,
                )
    return results
