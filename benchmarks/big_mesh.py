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

from cohaptic_server.bodies.mesh import Floats, Ints
from cohaptic_server.bodies.solid import Solid
from cohaptic_server.bodies.solid_shape import SolidSettings
from cohaptic_server.bodies.tetrahedra import EDGES, TetMesh, volumes

RING, TUBE = 0.06, 0.025  # m; radius of the middle of the tube, and of the tube
FOOT = -0.9 * TUBE  # m; what is below stands on a table and is held

# Vertices of the surface along the ring and round the tube, by thousands of tetrahedra.
SIZES = {1: (20, 12), 5: (32, 20), 20: (72, 32), 137: (160, 96)}
_FLATNESS = 0.7  # depth of a layer over the width of its cells
_CORE = 6  # vertices round the innermost tube


def ring(along: int, across: int) -> TetMesh:
    """A solid torus about the z axis, with that many vertices along its ring and round its tube."""
    n, m, radius = along, across, TUBE
    above = np.arange(n * m).reshape(n, m)
    places, tets, count = [_torus(n, m, radius)], list[Ints](), n * m
    while m > _CORE:
        long, wide = 2.0 * np.pi * RING / n, 2.0 * np.pi * radius / m
        radius -= _FLATNESS * (long * wide) ** 0.5
        turn = wide < long or n % 2 == 1  # halve where vertices are closer together
        n, m = (n, m // 2) if turn else (n // 2, m)
        below = count + np.arange(n * m).reshape(n, m)
        places.append(_torus(n, m, radius))
        tets += _halved(above.T, below.T) if turn else _halved(above, below)
        above, count = below, count + n * m
    places.append(_torus(n, 1, 0.0))
    middle = np.repeat(count + np.arange(n)[None], m, axis=0)
    tets += _prisms(above.T, np.roll(above.T, -1, axis=0), middle)
    return TetMesh.checked(np.concatenate(places), np.concatenate(tets))


def held(mesh: TetMesh) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """What stands on the table, shape (n,)."""
    return np.asarray(mesh.vertices[:, 2] < FOOT)


def solid(thousands: int) -> Solid:
    """The ring of that many thousand tetrahedra as a body: linear ones, soft tissue."""
    mesh = ring(*SIZES[thousands])
    return Solid(mesh, held(mesh), SolidSettings(order=1), name=f"ring of {len(mesh.tets)}")


def _torus(n: int, m: int, radius: float) -> Floats:
    """Points of a torus, the angle of the ring first, shape (n m, 3) [m]."""
    u, v = np.meshgrid(
        2.0 * np.pi * np.arange(n) / n, 2.0 * np.pi * np.arange(m) / m, indexing="ij"
    )
    out = RING + radius * np.cos(v)
    points = np.stack([out * np.cos(u), out * np.sin(u), radius * np.sin(v)], axis=-1)
    return np.asarray(points.reshape(-1, 3))


def _halved(above: Ints, below: Ints) -> list[Ints]:
    """Tetrahedra between a layer (2 k, l) and one of half as many rows (k, l), both periodic."""
    a, b, c = above[0::2], above[1::2], np.roll(above[0::2], -1, axis=0)
    d, e = below, np.roll(below, -1, axis=0)
    return [*_prisms(a, d, b), *_prisms(d, b, e), *_prisms(b, c, e)]


def _prisms(a: Ints, b: Ints, c: Ints) -> list[Ints]:
    """Triangles (k, l) drawn out along their second axis, which is periodic.

    A side is cut from its earlier corner to the later one of the next triangle. The corners come
    in one order everywhere (along rows, then down), so that neighbours cut it likewise.
    """
    d, e, f = (np.roll(p, -1, axis=1) for p in (a, b, c))
    quads = ((a, b, c, f), (a, b, e, f), (a, d, e, f))
    return [np.stack(quad, axis=-1).reshape(-1, 4) for quad in quads]


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
        f"{len(mesh.tets)} tetrahedra, {len(mesh.vertices)} nodes, {held(mesh).sum()} held;"
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
        print(f"column {1e-6 * body.columns.column_bytes:.2f} MB\n")
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
