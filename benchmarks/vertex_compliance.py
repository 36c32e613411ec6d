"""K_o over the surface of ten shapes, beside solves that share nothing with the body's.

    python benchmarks/vertex_compliance.py [--shapes torus box] [--vertices 300] [--json FILE]

The body computes its table while it is prepared (`bodies/solid/far_field.py`). At vertices
drawn at random from those that are free `plain_solid.py` assembles, presses and solves anew, with
none of the body's code but its discretisation. `held` and `free` count the vertices of the whole
surface that the table has wrong: a vertex whose contact touches nothing free has no compliance at
all, and every other one has some. Times are processor time on one thread.
"""

from __future__ import annotations

import time

import numpy as np
from threadpoolctl import threadpool_limits

import json_report
import plain_solid
from cohaptic_server.bodies.solid.far_field import build_far_field
from cohaptic_server.bodies.solid.parts import factor_of
from cohaptic_server.bodies.solid.shape import SolidShape, shape_of
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.numeric import Mask
from compared_shapes import SHAPES

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
    error = np.abs(table[some] / plain_solid.vertex_compliance(shape, some) - 1.0)
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
