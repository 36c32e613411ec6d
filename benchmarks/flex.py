"""MuJoCo's flex beside our solid, with the same tetrahedra and the same contacts.

    pip install "cohaptic[bench]"
    python benchmarks/flex.py [--thousands 1 5 20] [--users 1 8] [--step 0.0167] [--models FOLDER]
        [--json FILE]

A flex with all its degrees of freedom is a solid of linear tetrahedra as ours is, of the same E and
nu, but large (Saint Venant-Kirchhoff) and moving: steps solve (M + h D + h^2 K) a = f by conjugate
gradients (`integrator="discrete"`, backward Euler; elasticity takes no other implicit one), with
contacts as soft constraints. It does more than our solid, and it gives a force, but no stiffness
that a client could go on with.

Two figures say whether object and touch are the same. `C` is the displacement under the pressure of
a contact over its force, after steps in which inertia is nothing, over our Green's function of it.
`force` is the force on a ball of the contact's radius 2 mm deep: it touches a smaller area than the
contact, and its soft constraint yields a little, so the force is less than 2 mm K_o. Balls slide as
in `tick.py`.

With a step of 1/60 s, a server's period, most steps end before their linear solve has converged:
`short`, by its own warning. Its guide has 1 to 4 ms for elastic flexes (`--step 0.002`); then a
period is 4 to 16 steps. Large models take minutes to compile, so FOLDER keeps them.
"""

from __future__ import annotations

import importlib
import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

import json_report
from big_mesh import SIZES, solid
from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.mesh.tetrahedra import boundary
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.surface.accept import nearest_point
from cohaptic_server.testing.soft_ring import RING, TUBE, fixed, ring

PERIOD = 1.0 / 60.0  # s
DEPTH = 0.002  # m
LARGEST = 8  # balls
_DENSITY = 1000.0  # kg/m^3
_AT_REST = 10.0  # s; a step in which a flex comes to rest
_SETTLING = 6  # such steps
_SMALL = 1e-3  # N; so that large deformation plays no part
_BALL = '<body mocap="true" pos="0 0 {z}"><geom type="sphere" size="{radius}"/></body>'
_SCENE = """<mujoco>
  <option integrator="discrete" solver="CG" tolerance="1e-6" timestep="{h}" gravity="0 0 0">
    <flag refsafe="disable"/>
  </option>
  <worldbody>
    {balls}
    <flexcomp name="solid" type="direct" dim="3" radius="0" mass="{mass}"
              point="{points}" element="{elements}">
      <contact selfcollide="none" condim="1" solref="0.001 1" solimp="0.99 0.999 0.00001"/>
      <elasticity young="{young}" poisson="{nu}"/>
      <pin id="{pinned}"/>
    </flexcomp>
  </worldbody>
</mujoco>"""


@dataclass(frozen=True, slots=True)
class Stepped:
    """Steps under sliding balls.

    Args:
        median: Time of a step [s].
        slowest: Longest time [s].
        force: On a ball at the end [N].
        short: Share of steps whose linear solve did not converge.
    """

    median: float
    slowest: float
    force: float
    short: float


class TooLarge(Exception):
    """MuJoCo cannot make a model of this mesh on this machine."""


def library() -> Any:
    """MuJoCo, with warnings counted instead of printed; exits with advice if it is missing."""
    try:
        mujoco = importlib.import_module("mujoco")
        mujoco.set_mju_user_warning(str)
        return mujoco
    except ImportError as error:
        raise SystemExit(
            'MuJoCo is not installed: pip install "cohaptic[bench]", or leave the comparison out'
        ) from error


def compiled(thousands: int, body: Solid, folder: Path | None = None) -> Any:
    """A ring as MuJoCo's model with balls not yet in contact, from `folder` if it is kept there."""
    mujoco = library()
    kept = folder / f"ring{thousands}-{mujoco.__version__}.mjb" if folder else None
    if kept is not None and kept.exists():
        return mujoco.MjModel.from_binary_path(str(kept))
    mesh = ring(*SIZES[thousands])
    ball = _BALL.format(z=1.0, radius=body.contact_radius)
    scene = _SCENE.format(
        h=PERIOD,
        balls=ball * LARGEST,
        mass=_DENSITY * mesh.volume,
        points=_words(mesh.vertices),
        elements=_words(mesh.tets),
        young=body.settings.young,
        nu=body.settings.nu,
        pinned=_words(np.flatnonzero(fixed(mesh))),
    )
    try:
        model = mujoco.MjModel.from_xml_string(scene)
    except ValueError as error:
        raise TooLarge(f"MuJoCo {mujoco.__version__} has no model of it: {error}") from error
    if kept is not None:
        try:
            mujoco.mj_saveModel(model, str(kept))
        except ValueError as error:
            print(f"the model could not be kept: {error}", file=sys.stderr)
    return model


def same_stiffness(model: Any, thousands: int, body: Solid) -> tuple[float, float]:
    """Compliance of a contact on top of the ring as the flex has it over ours, and ours [m/N]."""
    mujoco = library()
    top = np.array([RING, 0.0, TUBE])
    foot = nearest_point(body.mesh, top)
    vertices, weights = pressure(body.mesh, foot, body.contact_radius)
    down = np.array([0.0, 0.0, -1.0])
    ours = float(body.respond([Load(vertices, weights, down, 1.0)]).compliance[0, 0])
    nodes = np.unique(boundary(ring(*SIZES[thousands]).tets))[vertices]
    first = model.body_dofadr[model.flex_vertbodyid[nodes]]
    state = mujoco.MjData(model)
    state.qfrc_applied[first + 2] = -_SMALL * weights
    before, model.opt.timestep = model.opt.timestep, _AT_REST
    for _ in range(_SETTLING):
        mujoco.mj_step(model, state)
    model.opt.timestep = before
    return -float(weights @ state.qpos[first + 2]) / _SMALL / ours, ours


def step(model: Any, users: int, steps: int, *, seconds: float = math.inf) -> Stepped:
    """Steps with balls that slide over the ring, once they have arrived; at most `seconds`."""
    mujoco = library()
    state = mujoco.MjData(model)
    height = TUBE - DEPTH + float(model.geom_size[0, 0])
    times: list[float] = []
    arriving = 10
    for tick in range(arriving + steps):
        state.mocap_pos[:users] = _centres(users, tick, height)
        start = time.perf_counter()
        mujoco.mj_step(model, state)
        if tick >= arriving:
            times.append(time.perf_counter() - start)
        if sum(times) > seconds:
            break
    total, force = 0.0, np.zeros(6)
    for k in range(state.ncon):
        mujoco.mj_contactForce(model, state, k, force)
        total += abs(force[0] * state.contact[k].frame[2])
    short = state.warning[mujoco.mjtWarning.mjWARN_INERTIA].number / (arriving + len(times))
    return Stepped(float(np.median(times)), max(times), total / users, short)


def _centres(users: int, tick: int, height: float) -> Floats:
    user = np.arange(users)
    angle = 2.0 * np.pi * user / users + 0.1 * np.sin(0.05 * tick + user)
    return np.stack([RING * np.cos(angle), RING * np.sin(angle), np.full(users, height)], axis=1)


def _words(values: Any) -> str:
    return " ".join(map(str, values.ravel().tolist()))


def main() -> None:
    """Print a table."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--thousands", type=int, nargs="+", default=[1, 5, 20], choices=SIZES)
    parser.add_argument("--users", type=int, nargs="+", default=[1, LARGEST])
    parser.add_argument("--steps", type=int, default=60, help="of each row")
    parser.add_argument("--step", type=float, default=PERIOD, help="of the flex, in seconds")
    parser.add_argument("--models", type=Path, default=None, help="folder of compiled models")
    options = parser.parse_args()
    results: list[json_report.Result] = []
    print("| tetrahedra | users | C over ours | step p50 | slowest | short | force | 2 mm K_o |")
    print("|---|---|---|---|---|---|---|---|")
    with threadpool_limits(limits=1):
        for thousands in options.thousands:
            body = solid(thousands)
            model = compiled(thousands, body, options.models)
            ratio, ours = same_stiffness(model, thousands, body)
            model.opt.timestep = options.step
            for users in options.users:
                row = step(model, users, options.steps, seconds=60.0)
                print(
                    f"| {model.nflexelem} | {users} | {ratio:.4f} | {1e3 * row.median:.1f} ms"
                    f" | {1e3 * row.slowest:.1f} ms | {row.short:.0%} | {row.force:.3f} N"
                    f" | {DEPTH / ours:.2f} N |"
                )
                results.append(
                    {
                        "tetrahedra": int(model.nflexelem),
                        "users": users,
                        "compliance_over_ours": ratio,
                        "step_p50_s": row.median,
                        "step_slowest_s": row.slowest,
                        "short": row.short,
                        "force_n": row.force,
                        "depth_times_k_o_n": DEPTH / ours,
                    }
                )
    json_report.write(options, results)


if __name__ == "__main__":
    main()
