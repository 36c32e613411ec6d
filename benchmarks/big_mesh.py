"""A ring of soft tissue for benchmarks: fine at its surface, coarse inside, of several sizes.

    python benchmarks/big_mesh.py [--thousands 137] [--json FILE]

Contacts need a fine surface; below, each layer has half as many vertices as the one above. `SIZES`
lists the meshes of the tables. As a program it measures one of them: building its factor, and
solving for its columns in batches.
"""

from __future__ import annotations

import math
import time

import numpy as np
from threadpoolctl import threadpool_limits

import json_report
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh, volumes
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.soft_ring import fixed, ring

# Vertices of the surface along the ring and round the tube, by thousands of tetrahedra.
SIZES = {1: (20, 12), 5: (32, 20), 20: (72, 32), 137: (160, 96)}


def solid(thousands: int) -> Solid:
    """The ring of so many thousand linear tetrahedra, as a body of soft tissue."""
    mesh = ring(*SIZES[thousands])
    return Solid(mesh, fixed(mesh), SolidSettings(order=1), name=f"ring of {len(mesh.tets)}")


def shape(mesh: TetMesh) -> Floats:
    """6 sqrt(2) V over the cube of the root mean square edge: 1 for a regular one, shape (m,)."""
    edges = mesh.vertices[mesh.tets[:, [a for a, _ in EDGES]]]
    edges = edges - mesh.vertices[mesh.tets[:, [b for _, b in EDGES]]]
    mean = np.einsum("mei,mei->m", edges, edges) / len(EDGES)
    return np.asarray(6.0 * 2.0**0.5 * volumes(mesh.vertices, mesh.tets) / mean**1.5)


def main() -> None:
    """Print the costs of a ring."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--thousands", type=int, default=137, choices=sorted(SIZES))
    options = parser.parse_args()
    thousands = options.thousands
    results: list[json_report.Result] = []
    start = time.perf_counter()
    mesh = ring(*SIZES[thousands])
    quality = shape(mesh)
    meshed = time.perf_counter() - start
    print(
        f"{len(mesh.tets)} tetrahedra, {len(mesh.vertices)} nodes, {fixed(mesh).sum()} held;"
        f" shape at least {quality.min():.2f}, median {np.median(quality):.2f};"
        f" meshed in {meshed:.2f} s"
    )
    with threadpool_limits(limits=1):
        start = time.perf_counter()
        body = solid(thousands)
        built = time.perf_counter() - start
        n = len(body.mesh.vertices)
        print(f"{n} surface vertices; contact radius {1e3 * body.contact_radius:.1f} mm")
        print(f"built in {built:.1f} s; factor {1e-6 * body.factor_bytes:.0f} MB")
        results.append(
            {
                "tetrahedra": len(mesh.tets),
                "nodes": len(mesh.vertices),
                "surface_vertices": n,
                "meshed_s": meshed,
                "built_s": built,
                "factor_bytes": body.factor_bytes,
                "column_bytes": body.columns.store.column_bytes,
            }
        )
        # A hand presses vertices that lie together: the nearest ones to the outermost.
        x = body.mesh.vertices
        near = np.argsort(np.linalg.norm(x - x[x[:, 0].argmax()], axis=1))
        print(f"column {1e-6 * body.columns.store.column_bytes:.2f} MB\n")
        print("| vertices | solve | per vertex |\n|---|---|---|")
        for k in (1, 8, 24, 100):
            least = math.inf
            for _ in range(3):
                start = time.perf_counter()
                body.columns.respond(near[:k], np.eye(3 * k).reshape(k, 3, 3 * k))
                least = min(least, time.perf_counter() - start)
            print(f"| {k} | {1e3 * least:.0f} ms | {1e3 * least / k:.1f} ms |")
            results.append({"vertices": k, "solve_s": least, "per_vertex_s": least / k})
    json_report.write(options, results)


if __name__ == "__main__":
    main()
