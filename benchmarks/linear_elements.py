"""How much stiffer linear tetrahedra make a block under a fingertip than it is.

    python benchmarks/linear_elements.py [--cells 8 12] [--json FILE]

The block of `compared_shapes.py`, 100 x 80 x 60 mm and held by its foot, pressed in the middle of
its top, with so many cells of six tetrahedra along its length. The contact radius is a fingertip's
and the one that the linear mesh is given by default, two spacings of its vertices. `limit` is what
quadratic elements approach: the value on the finest of these cells, and `quadratic` is how far the
same cells are off it with quadratic elements, so that it can be seen what the limit is worth.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from threadpoolctl import threadpool_limits

import json_report
from cohaptic_server.bodies.solid.parts import factor_of
from cohaptic_server.bodies.solid.shape import FINGERTIP, SolidSettings, fitting_radius, shape_of
from cohaptic_server.cholesky.symbolic import dofs
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.blocks import block

_SIZE = (0.1, 0.08, 0.06)  # m
_POISSON = (0.3, 0.45, 0.49)
_FINEST = 16  # cells along the length for the limit: 12,480 tetrahedra


def compliance(cells: int, order: int, nu: float, radii: Sequence[float]) -> Floats:
    """Compliance of presses in the middle of the top, shape (k,) [m/N].

    Args:
        cells: Along the length of the block.
        order: Order of the elements.
        nu: Poisson's ratio.
        radii: Radii of the contacts [m].
    """
    tets, top = block(_SIZE, _cells(cells)), np.array([0.0, 0.0, _SIZE[2]])
    shape = shape_of(tets, tets.vertices[:, 2] <= 0.0, SolidSettings(nu=nu, order=order))
    factor, found = factor_of(shape), list[float]()
    for radius in radii:
        under, weights = pressure(shape.mesh, top, radius, np.array([0.0, 0.0, 1.0]))
        force = np.zeros((3 * len(under), 1))
        force[2::3, 0] = weights
        nodes = shape.free_index[under]
        found.append(float(force[:, 0] @ factor.solve(nodes, force)[dofs(nodes), 0]))
    return np.array(found)


def default_radius(cells: int) -> float:
    """Contact radius of the block of linear elements, if none is given [m]."""
    tets = block(_SIZE, _cells(cells))
    shape = shape_of(tets, tets.vertices[:, 2] <= 0.0, SolidSettings(order=1))
    return fitting_radius(shape.mesh)


def _cells(along: int) -> tuple[int, int, int]:
    return along, round(0.8 * along), round(0.6 * along)


def main() -> None:
    """Print a table."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--cells", type=int, nargs="+", default=[8, 12])
    options = parser.parse_args()
    results: list[json_report.Result] = []
    print(
        "| cells | radius | Poisson's ratio | linear, stiffer by | quadratic |\n" + "|---" * 5 + "|"
    )
    radii = [(cells, r) for cells in options.cells for r in (FINGERTIP, default_radius(cells))]
    with threadpool_limits(limits=1):
        for nu in _POISSON:
            limits = compliance(_FINEST, 2, nu, [radius for _, radius in radii])
            for (cells, radius), limit in zip(radii, limits, strict=True):
                linear, quadratic = (
                    float(limit / compliance(cells, order, nu, [radius])[0]) - 1.0
                    for order in (1, 2)
                )
                print(
                    f"| {cells} | {1e3 * radius:.1f} mm | {nu:g} | {linear:.0%} |"
                    f" {quadratic:+.1%} |",
                    flush=True,
                )
                row: json_report.Result = {
                    "cells": cells,
                    "radius_m": radius,
                    "poisson": nu,
                    "linear_stiffer_by": linear,
                    "quadratic_stiffer_by": quadratic,
                }
                results.append(row)
    json_report.write(options, results)


if __name__ == "__main__":
    main()
