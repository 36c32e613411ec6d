"""A ring of soft tissue to measure with: fine at its surface, coarse inside, of any size.

    python benchmarks/big_mesh.py [--thousands 137]

What is touched is the surface, so that is where the vertices are; below, each layer has half as
many. `SIZES` has the meshes of the tables. As a program it says what one of them costs: its factor,
and its columns by the batch.
"""

from __future__ import annotations

import argparse
import math
import time

import numpy as np
from threadpoolctl import threadpool_limits

from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh, volumes
from cohaptic_server.numeric import Floats
from cohaptic_server.testing.soft_ring import fixed, ring

# Vertices of the surface along the ring and round the tube, by thousands of tetrahedra.
SIZES = {1: (20, 12), 5: (32, 20), 20: (72, 32), 137: (160, 96)}


def solid(thousands: int) -> Solid:
    """The ring of that many thousand tetrahedra as a body: linear ones, soft tissue."""
    mesh = ring(*SIZES[thousands])
    return Solid(mesh, fixed(mesh), SolidSettings(order=1), name=f"ring of {len(mesh.tets)}")


def shape(mesh: TetMesh) -> Floats:
    """6 sqrt(2) V over the cube of the root mean square edge: 1 for a regular one, shape (m,)."""
    edges = mesh.vertices[mesh.tets[:, [a for a, _ in EDGES]]]
    edges = edges - mesh.vertices[mesh.tets[:, [b for _, b in EDGES]]]
    mean = np.einsum("mei,mei->m", edges, edges) / len(EDGES)
    return np.asarray(6.0 * 2.0**0.5 * volumes(mesh.vertices, mesh.tets) / mean**1.5)


def main() -> None:
    """Print what a ring costs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--thousands", type=int, default=137, choices=sorted(SIZES))
    thousands = parser.parse_args().thousands
    start = time.perf_counter()
    mesh = ring(*SIZES[thousands])
    quality = shape(mesh)
    print(
        f"{len(mesh.tets)} tetrahedra, {len(mesh.vertices)} nodes, {fixed(mesh).sum()} held;"
        f" shape at least {quality.min():.2f}, median {np.median(quality):.2f};"
        f" meshed in {time.perf_counter() - start:.2f} s"
    )
    with threadpool_limits(limits=1):
        start = time.perf_counter()
        body = solid(thousands)
        built = time.perf_counter() - start
        n = len(body.mesh.vertices)
        print(f"{n} surface vertices; contact radius {1e3 * body.contact_radius:.1f} mm")
        print(f"built in {built:.1f} s; factor {1e-6 * body.factor_bytes:.0f} MB")
        # A hand presses vertices that lie together: the nearest ones to the outermost.
        x = body.mesh.vertices
        near = np.argsort(np.linalg.norm(x - x[x[:, 0].argmax()], axis=1))
        print(f"column {1e-6 * body.columns.store.column_bytes:.2f} MB\n")
        print("| vertices | solve | per vertex |\n|---|---|---|")
        for k in (1, 8, 24, 100):
            took = math.inf
            for _ in range(3):
                start = time.perf_counter()
                body.columns.respond(near[:k], np.eye(3 * k).reshape(k, 3, 3 * k))
                took = min(took, time.perf_counter() - start)
            print(f"| {k} | {1e3 * took:.0f} ms | {1e3 * took / k:.1f} ms |")


if __name__ == "__main__":
    main()
