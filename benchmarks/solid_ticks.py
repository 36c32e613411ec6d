"""Ticks of a solid over mesh size and users, in real time, beside a lower bound of their cost.

Hands slide to and fro on a ring (`big_mesh.py`), so that vertices are newly touched all the time.
Ticks start at 60 Hz by the clock and not back to back, so that the column worker gets the time
between them that it would get on a server.

The floor is the time to read once, at the rate at which this machine reads the same number of bytes
in a row, what a tick needs: of each column under a contact the rows at which it is evaluated, and
of the far field the rows of the samples round each contact. It holds no cache line that is read for
a part of it, and no arithmetic.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import json_report
from big_mesh import SIZES, solid
from cohaptic.control.law import Law
from cohaptic.protocol.patch import Geometry
from cohaptic_server.bodies.body import Load, Response
from cohaptic_server.bodies.solid.solid import Solid, SolidResponse
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.shell.column_worker import ColumnWorker
from cohaptic_server.testing.soft_ring import RING, TUBE, ring
from cohaptic_server.world.state import Participant, Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState
from flex import DEPTH, LARGEST, TooLarge, compiled, step
from memory import read_time

PERIOD = 1.0 / 60.0  # s
_WAY = 0.01  # m; to both sides


@dataclass(frozen=True, slots=True)
class Ticks:
    """Costs of ticks.

    Args:
        median: Median of a tick [s].
        p99: 99th percentile [s].
        missed: Share of ticks that took more than a period.
        body: Median of the body's part of a tick [s].
        needed: Median of the bytes of columns and far field that a tick needs.
        floor: Time to read these once [s].
    """

    median: float
    p99: float
    missed: float
    body: float
    needed: float
    floor: float


class TimedBody:
    """A solid that knows how long it was asked.

    Args:
        solid: The body.

    Attributes:
        seconds: In its answers since the beginning [s].
    """

    linear = True

    def __init__(self, solid: Solid) -> None:
        self.solid, self.seconds = solid, 0.0
        self.name, self.mesh, self.contact_radius = solid.name, solid.mesh, solid.contact_radius

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> TimedResponse:
        """The solid's response."""
        with self.timed():
            return TimedResponse(self, self.solid.respond(loads, before))

    def prefetch(self, vertices: Ints) -> None:
        """As the solid's."""
        self.solid.prefetch(vertices)

    def vertex_compliance(self) -> Floats:
        """As the solid's."""
        return self.solid.vertex_compliance()

    @contextmanager
    def timed(self) -> Generator[None]:
        """Count the time of what is done within."""
        start = time.perf_counter()
        yield
        self.seconds += time.perf_counter() - start


@dataclass(frozen=True, eq=False)
class TimedResponse:
    """A response whose evaluation counts as the body's time."""

    body: TimedBody
    response: Response

    @property
    def compliance(self) -> Floats:
        """As the response's."""
        with self.body.timed():
            return self.response.compliance

    @property
    def energy(self) -> float:
        """As the response's."""
        return self.response.energy

    @property
    def displacement(self) -> Floats:
        """As the response's."""
        return self.response.displacement

    def displacement_of(self, vertices: Ints) -> Floats:
        """As the response's."""
        with self.body.timed():
            return self.response.displacement_of(vertices)

    def without(self, loads: slice, forces: Floats, vertices: Ints) -> Floats:
        """As the response's."""
        with self.body.timed():
            return self.response.without(loads, forces, vertices)


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
                who=Participant(
                    user=user + 1,
                    law=Law.PREDICTIVE,
                    max_stiffness=1000.0,
                    max_force=10.0,
                    geometry=Geometry.MESH,
                ),
                probe=place,
                force=(0.0, 0.0, 1.0),
                seq=tick + 1,
                tick=tick,
                t_client=0.0,
                arrived=0.0,
            )
        )
    return touches


def measure(body: Solid, worker: ColumnWorker, users: int, ticks: int, *, speed: float) -> Ticks:
    """Run ticks by the clock, the first second not counted.

    Args:
        body: The solid.
        worker: Computes its columns.
        users: How many touch it.
        ticks: How many are measured.
        speed: At which hands slide [m/s].
    """
    timed = TimedBody(body)
    touched = TouchedBody(timed)
    state, due = WorldState(), time.perf_counter()
    rows: list[tuple[float, float, float]] = []
    for tick in range(60 + ticks):
        time.sleep(max(0.0, due - time.perf_counter()))
        due = max(due + PERIOD, time.perf_counter())
        now = hands(users, tick, speed)
        own, read = timed.seconds, body.columns.store.kernel.rows_read
        start = time.perf_counter()
        worker.pump()
        state, _ = advance(touched, state, now, now=tick * PERIOD, dt=PERIOD)
        whole = time.perf_counter() - start
        read = body.columns.store.kernel.rows_read - read
        rows.append((whole, timed.seconds - own, 36.0 * read + _far_field_bytes(state)))
    figures: Floats = np.array(rows[60:])
    counted, limit = figures[:, 0], float(np.median(figures[:, 2]))
    return Ticks(
        float(np.median(counted)),
        float(np.quantile(counted, 0.99)),
        float(np.mean(counted > PERIOD)),
        float(np.median(figures[:, 1])),
        limit,
        read_time(round(limit)),
    )


def _far_field_bytes(state: WorldState) -> int:
    """Bytes of the far field's rows of the samples round each present contact, once each."""
    response = state.response
    assert isinstance(response, TimedResponse)
    solid = response.response
    assert isinstance(solid, SolidResponse)
    samples = len(solid.around.far_field.samples)
    used = np.zeros(samples, dtype=np.bool_)
    for contact in solid.contacts:
        used |= contact.spread != 0.0
    return int(used.sum()) * 36 * samples


def _model(thousands: int, body: Solid, models: Path | None) -> Any:
    """MuJoCo's model of a ring; None if not requested or too large."""
    try:
        return compiled(thousands, body, models) if models is not None else None
    except TooLarge as error:
        print(f"  {error}", file=sys.stderr)
        return None


def table(
    sizes: list[int], ticks: int, *, speed: float, models: Path | None = None
) -> list[json_report.Result]:
    """Print the rows of all sizes, with MuJoCo's flex if there is a folder for its models.

    Args:
        sizes: Thousands of tetrahedra, keys of `SIZES`.
        ticks: Ticks of each row.
        speed: At which hands slide [m/s].
        models: Folder of compiled models.

    Returns:
        The rows.
    """
    results: list[json_report.Result] = []
    print(f"\nSolids; hands slide at {speed:g} m/s\n")
    print(
        "| tetrahedra | surface | users | tick p50 | p99 | missed | body | needed | floor"
        " | body over it | tick over it | flex |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    for thousands in sizes:
        count = len(ring(*SIZES[thousands]).tets)
        with served(thousands) as (body, worker):
            model = _model(thousands, body, models)
            for users in (1, 2, 4, 8, 16):
                t = measure(body, worker, users, ticks, speed=speed)
                fits = model is not None and users <= LARGEST
                flex = step(model, users, 20).median if fits else None
                beside = "" if flex is None else f"{1e3 * flex:.0f} ms"
                results.append(
                    {
                        "tetrahedra": count,
                        "surface_vertices": len(body.mesh.vertices),
                        "users": users,
                        "tick_p50_s": t.median,
                        "tick_p99_s": t.p99,
                        "missed": t.missed,
                        "body_p50_s": t.body,
                        "needed_bytes": t.needed,
                        "floor_s": t.floor,
                        "body_over_floor": t.body / t.floor,
                        "tick_over_floor": t.median / t.floor,
                        "flex_step_p50_s": flex,
                    }
                )
                print(
                    f"| {count} | {len(body.mesh.vertices)} | {users}"
                    f" | {1e3 * t.median:.2f} ms | {1e3 * t.p99:.2f} ms | {t.missed:.1%}"
                    f" | {1e3 * t.body:.2f} ms | {1e-6 * t.needed:.1f} MB | {1e3 * t.floor:.2f} ms"
                    f" | {t.body / t.floor:.1f} | {t.median / t.floor:.1f} | {beside} |",
                    flush=True,
                )
    return results
