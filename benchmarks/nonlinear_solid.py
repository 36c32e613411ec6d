"""Cost of a tick of a nonlinear solid over its mesh, and of its parts.

    python benchmarks/nonlinear_solid.py [--ticks 300] [--json FILE]

Two users press a ring of soft tissue 10 mm deep on opposite sides and slide along it at 0.1 m/s.
Times are processor times, with one BLAS thread as on the server, so that other work on the machine
has little influence. What two cores share (`side_by_side.py`) is done here by one thread, one part
after the other: `one core` is the time of both parts, `two cores` that of the longer one, as where
the second core is free; to wake it up takes some 0.05 ms for each of about ten parts of a tick,
which is not in it. `forces` is one evaluation of energy and forces, `tangent` its assembly,
`factor` and `solve` (three right-hand sides, refined) the new tangent's; beside them other factors
of the same matrix: SuperLU with minimum degree, LAPACK's band after reverse Cuthill-McKee.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg
from scipy.linalg import lapack
from threadpoolctl import threadpool_limits

import json_report
from cohaptic.control.law import Law
from cohaptic.protocol.patch import Patch
from cohaptic.vec import Vec3, dot, scale, sub
from cohaptic_server.bodies.rubber_solid import rubber_tetrahedra
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.solid.parts import stiffness_of
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.cholesky import refactor
from cohaptic_server.cholesky.refined import Refined, Workspaces
from cohaptic_server.cholesky.symbolic import analyse
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.soft_ring import RING, TUBE, ring
from cohaptic_server.world.state import Participant, Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState

PERIOD = 1.0 / 60.0  # s
SPEED = 0.1  # m/s along the ring
DEPTH = 0.01  # m
SIZES = ((8, 6), (16, 6), (14, 8), (18, 8), (18, 10), (20, 12), (36, 10))
A = TypeVar("A")
B = TypeVar("B")
TIMES = 3  # runs of the same ticks; of each tick the quickest counts


class TwoCores:
    """Takes the place of `both`; counts the time that a second core would save.

    Attributes:
        saved: Time of the shorter parts so far [s].
    """

    saved = 0.0

    def both(self, first: Callable[[], A], second: Callable[[], B]) -> tuple[A, B]:
        """Both parts, one after the other."""
        start = time.thread_time()
        one = first()
        middle = time.thread_time()
        other = second()
        self.saved += min(middle - start, time.thread_time() - middle)
        return one, other


CORES = TwoCores()


class CountingFactor(Refined):
    """A factor that is counted when it is made."""

    made = 0

    def __init__(self, workspaces: Workspaces, blocks: Floats) -> None:
        CountingFactor.made += 1
        super().__init__(workspaces, blocks)


def body(along: int, across: int) -> RubberSolid:
    """The ring, of quadratic elements."""
    mesh = ring(along, across)
    return RubberSolid(mesh, mesh.vertices[:, 2] < -0.6 * TUBE, SolidSettings(young=2e4))


def ticks(solid: RubberSolid, count: int) -> list[tuple[float, float]]:
    """Processor time of each tick on one core, and on two [s]."""
    state, forces = WorldState(), [(0.0, 0.0, 0.0)] * 2
    spent: list[tuple[float, float]] = []
    for tick in range(count):
        touches = list[Touch]()
        for user, force in enumerate(forces):
            angle = math.pi * user + SPEED * tick * PERIOD / RING
            height = TUBE - DEPTH * min(1.0, tick / 20)
            probe = (RING * math.cos(angle), RING * math.sin(angle), height)
            touches.append(
                Touch(
                    who=Participant(
                        user=user + 1, law=Law.PREDICTIVE, max_stiffness=2000.0, max_force=10.0
                    ),
                    probe=probe,
                    force=force,
                    seq=tick + 1,
                    tick=tick,
                    t_client=tick * PERIOD,
                    arrived=tick * PERIOD,
                )
            )
        start, saved = time.thread_time(), CORES.saved
        state, patches = advance(TouchedBody(solid), state, touches, now=tick * PERIOD, dt=PERIOD)
        whole = time.thread_time() - start
        spent.append((whole, whole - (CORES.saved - saved)))
        forces = [_felt(patches[t.user], t.probe) for t in touches]
    return spent


def _felt(patch: Patch, probe: Vec3) -> Vec3:
    pressed = patch.k_h * dot(sub(patch.x_free, probe), patch.normal)
    return scale(patch.normal, min(10.0, max(0.0, pressed)))


def quickest(work: Callable[[], object], times: int = 7) -> float:
    """Least processor time of several runs [s]."""
    best = math.inf
    for _ in range(times):
        start = time.thread_time()
        work()
        best = min(best, time.thread_time() - start)
    return best


def main() -> None:
    """Print a table."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--ticks", type=int, default=300, help="of each row")
    options = parser.parse_args()
    print(
        "| tetrahedra | nodes | forces | tangent | factor | solve | SuperLU | band"
        " | one core: tick p50 | p99 | two cores: tick p50 | p99 | worst | factors a tick |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    refactor.both = rubber_tetrahedra.both = CORES.both  # type: ignore[attr-defined]
    with threadpool_limits(limits=1):
        results = [row(body(*size), options.ticks) for size in SIZES]
    json_report.write(options, results)


def row(solid: RubberSolid, count: int) -> json_report.Result:
    """Measure one mesh, and print its row."""
    shape, rubber = solid.shape, solid.rubber
    free = np.flatnonzero(~shape.fixed)
    whole = stiffness_of(shape)
    K = sp.csr_array(whole[rubber.dof][:, rubber.dof])
    state = rubber.state(shape.nodes)
    assert state is not None
    number = np.where(shape.fixed, -1, np.cumsum(~shape.fixed) - 1)
    workspaces = Workspaces(analyse(number[shape.elements], shape.nodes[free]))
    blocks = rubber.tangent(state)
    b = np.random.default_rng(0).normal(size=(K.shape[0], 3))
    refined = Refined(workspaces, blocks)
    parts = {
        "forces_s": quickest(lambda: rubber.state(shape.nodes)),
        "tangent_s": quickest(lambda: rubber.tangent(state)),
        "factor_s": quickest(lambda: Refined(workspaces, blocks)),
        "solve_s": quickest(lambda: refined.checked(b)),
    }
    columns = sp.csc_matrix(K)
    options = {"SymmetricMode": True, "DiagPivotThresh": 0.0}
    superlu = quickest(
        lambda: scipy.sparse.linalg.splu(columns, permc_spec="MMD_AT_PLUS_A", options=options), 3
    )
    p = sp.csgraph.reverse_cuthill_mckee(sp.csr_matrix(K), symmetric_mode=True)
    lower = sp.coo_array(sp.tril(K[p][:, p]))
    width = int((lower.row - lower.col).max())
    banded = np.zeros((width + 1, K.shape[0]), order="F")
    banded[lower.row - lower.col, lower.col] = lower.data
    band = quickest(lambda: lapack.dpbtrf(banded, lower=1), 3)
    rubber_tetrahedra.Refined = CountingFactor  # type: ignore[attr-defined]
    CountingFactor.made = 0
    one, t = np.min([ticks(solid, count) for _ in range(TIMES)], axis=0).T
    made = CountingFactor.made / (TIMES * count)
    print(
        f"| {len(shape.elements)} | {len(shape.nodes)} | "
        + " | ".join(f"{1e3 * s:.1f}" for s in (*parts.values(), superlu, band))
        + f" | {1e3 * np.median(one):.1f} | {1e3 * np.quantile(one, 0.99):.1f}"
        f" | {1e3 * np.median(t):.1f} | {1e3 * np.quantile(t, 0.99):.1f}"
        f" | {1e3 * t.max():.1f} | {made:.2f} |",
        flush=True,
    )
    return parts | {
        "tetrahedra": len(shape.elements),
        "nodes": len(shape.nodes),
        "unknowns": int(K.shape[0]),
        "superlu_s": superlu,
        "band_s": band,
        "one_core_p50_s": float(np.median(one)),
        "one_core_p99_s": float(np.quantile(one, 0.99)),
        "tick_p50_s": float(np.median(t)),
        "tick_p99_s": float(np.quantile(t, 0.99)),
        "tick_worst_s": float(t.max()),
        "factors_a_tick": made,
    }


if __name__ == "__main__":
    main()
