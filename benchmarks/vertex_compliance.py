"""K_o over the surface of ten shapes, beside solves that share nothing with the body's.

    python benchmarks/vertex_compliance.py [--shapes torus box] [--vertices 300] [--json FILE]

The body computes its table while it is prepared (`bodies/solid/far_field_build.py`). At vertices
drawn at random from those that are free SciPy's sparse LU solves for the same press. `held` and
`free` count the vertices of the whole surface that the table has wrong: a vertex whose contact
touches nothing free has no compliance at all, and every other one has some. Times are processor
time on one thread.
"""

from __future__ import annotations

import time

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu
from threadpoolctl import threadpool_limits

import json_report
from cohaptic_server.bodies.solid.far_field_build import build_far_field
from cohaptic_server.bodies.solid.parts import factor_of, stiffness_of
from cohaptic_server.bodies.solid.shape import SolidSettings, SolidShape, shape_of
from cohaptic_server.mesh.pressure import pressure
from cohaptic_server.numeric import Floats, Ints, Mask
from compared_shapes import SHAPES

_BATCH = 16  # presses solved for together
_CLOSE, _FAR = 0.05, 0.3  # relative errors that are counted
_COLUMNS = (
    ("shape", "{}"),
    ("tetrahedra", "{:,}"),
    ("surface_vertices", "{:,}"),
    ("share_within_5_percent", "{:.1%}"),
    ("share_off_by_30_percent", "{:.1%}"),
    ("worst_error", "{:.1e}"),
    ("free_reported_held", "{}"),
    ("held_reported_free", "{}"),
    ("softest_over_stiffest", "{:.1e}"),
    ("factor_s", "{:.1f} s"),
    ("presses_s", "{:.1f} s"),
)


def exact(shape: SolidShape, settings: SolidSettings, vertices: Ints) -> Floats:
    """C_ii of a contact centred at some vertices, along their normals, shape (k,) [m/N]."""
    mesh, free = shape.mesh, np.flatnonzero(~shape.fixed)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    K = stiffness_of(shape)[dof][:, dof]
    options = {"SymmetricMode": True}
    lu = splu(sp.csc_array(K), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    out = np.empty(len(vertices))
    for start in range(0, len(vertices), _BATCH):
        batch = vertices[start : start + _BATCH]
        force = np.zeros((len(shape.nodes), 3, len(batch)))
        for i, k in enumerate(batch.tolist()):
            normal = mesh.normals[k]
            under, weights = pressure(mesh, mesh.vertices[k], shape.contact_radius, normal)
            force[shape.surface[under], :, i] = weights[:, None] * normal
        loaded = force[free].reshape(-1, len(batch))
        out[start : start + len(batch)] = (loaded * lu.solve(loaded)).sum(axis=0)
    return out


def touches_free(shape: SolidShape) -> Mask:
    """Whether anything free is under a contact centred at each vertex, shape (n,)."""
    mesh, free = shape.mesh, shape.free_index >= 0
    found = [
        free[pressure(mesh, at, shape.contact_radius, normal)[0]].any()
        for at, normal in zip(mesh.vertices, mesh.normals, strict=True)
    ]
    return np.array(found)


def measure(name: str, count: int) -> dict[str, float | int | str]:
    """One row of the table."""
    made = SHAPES[name]()
    shape = shape_of(made.tets, made.fixed, made.settings)
    start = time.process_time()
    factor = factor_of(shape)
    factored = time.process_time()
    far_field = build_far_field(shape.mesh, shape.contact_radius, factor, shape.free_index)
    pressed = time.process_time()
    table = far_field.vertex_compliance(shape.mesh.normals)
    free = np.flatnonzero(shape.free_index >= 0)
    some = np.random.default_rng(0).permutation(free)[:count]
    error = np.abs(table[some] / exact(shape, made.settings, some) - 1.0)
    moves = touches_free(shape)
    return {
        "shape": name,
        "tetrahedra": len(made.tets.tets),
        "surface_vertices": len(table),
        "vertices_checked": len(some),
        "share_within_5_percent": float((error <= _CLOSE).mean()),
        "share_off_by_30_percent": float((error > _FAR).mean()),
        "worst_error": float(error.max()),
        "free_reported_held": int((moves & ~(table > 0.0)).sum()),
        "held_reported_free": int((~moves & (table != 0.0)).sum()),
        "softest_over_stiffest": float(table[free].max() / table[free].min()),
        "factor_s": factored - start,
        "presses_s": pressed - factored,
    }


def main() -> None:
    """Print the table."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--shapes", nargs="*", default=list(SHAPES), choices=list(SHAPES))
    parser.add_argument("--vertices", type=int, default=300, help="checked on each shape")
    options = parser.parse_args()
    results: list[json_report.Result] = []
    print(
        "| shape | tetrahedra | vertices | within 5 % | off by 30 % | worst | held | free |", end=""
    )
    print(" C_ii, max over min | factor | presses |")
    print("|---" * 11 + "|")
    with threadpool_limits(limits=1):
        for name in options.shapes:
            row = measure(name, options.vertices)
            results.append(row)
            print(
                "| " + " | ".join(style.format(row[key]) for key, style in _COLUMNS) + " |",
                flush=True,
            )
    json_report.write(options, results)


if __name__ == "__main__":
    main()
