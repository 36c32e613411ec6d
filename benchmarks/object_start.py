"""Time that a server takes to load an object from a file, with an empty store and a full one.

    python benchmarks/object_start.py [FILE] [--fix "z < 15%"] [--edge 0.05] [--json FILE]

Every start is a process of its own: `body` is from its first line to a solid that answers, `all`
with Python and its libraries. The store is a folder that is gone afterwards. The first start after
another one finds the file in the system's memory; one after days reads it from the disk.

The row `floor` is what the start with an empty store cannot do without, by libraries alone: one run
of fTetWild on the same surface, and one factorisation of the same stiffness by SuperLU (scipy,
which has no other direct solver; unsymmetric, so with twice the arithmetic of Cholesky). The
tetrahedra are those of the store, since fTetWild makes others each time.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from pytetwild.pytetwild import tetrahedralize
from scipy.sparse.linalg import splu

import json_report
from cohaptic_server.bodies.solid.parts import stiffness_of
from cohaptic_server.bodies.solid.shape import shape_of
from cohaptic_server.objects.build import build_solid
from cohaptic_server.objects.fix_rule import fixed_vertices
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store.store import load_or_prepare
from cohaptic_server.objects.surface.surface_file import read_surface
from cohaptic_server.objects.tetrahedralise import envelope

ORGAN = Path(__file__).parents[1] / "examples/organ.ply"


def start(path: Path, fix: str, edge: float) -> None:
    """One start: build the object, and solve for its first response."""
    begin = time.perf_counter()
    solid = build_solid(ObjectFile(path, fix, edge=edge))
    solid.in_background()
    solid.respond([])
    print(
        f"{time.perf_counter() - begin:.2f} {len(solid.shape.tets.tets)}"
        f" {len(solid.mesh.vertices)} {solid.factor_bytes / 1e6:.0f}"
    )


def floor(path: Path, fix: str, edge: float) -> None:
    """Print the seconds of one run of fTetWild, and of one factorisation by SuperLU."""
    source = ObjectFile(path, fix, edge=edge)
    x, faces = read_surface(path)
    begin = time.perf_counter()
    tetrahedralize(
        x, faces.astype(np.int32), edge_length_fac=edge, epsilon=envelope(edge), num_threads=1
    )
    filled = time.perf_counter()
    tets = load_or_prepare(source).tets
    shape = shape_of(tets, fixed_vertices(source, tets.vertices), source.material)
    free = np.flatnonzero(~np.repeat(shape.fixed, 3))
    matrix = sp.csc_matrix(stiffness_of(shape, source.material)[free][:, free])
    assembled = time.perf_counter()
    splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    print(f"{filled - begin:.2f} {time.perf_counter() - assembled:.2f}")


def main() -> None:
    """Start with an empty store and twice with a full one, and print the times."""
    parser = json_report.parser(__doc__)
    parser.add_argument("file", type=Path, nargs="?", default=ORGAN)
    parser.add_argument("--fix", default="z < 15%")
    parser.add_argument("--edge", type=float, default=0.05)
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--floor", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one or options.floor:
        (start if options.one else floor)(options.file, options.fix, options.edge)
        return
    print(f"{'store':>7} {'all':>8} {'body':>8}  tetrahedra, vertices of surface, MB of factor")
    results: list[json_report.Result] = []
    with tempfile.TemporaryDirectory() as folder:
        for store in ("empty", "full", "full", "floor"):
            begin = time.perf_counter()
            arguments = [str(options.file), "--fix", options.fix, "--edge", str(options.edge)]
            what = "--floor" if store == "floor" else "--one"
            done = subprocess.run(
                [sys.executable, __file__, what, *arguments],
                env=os.environ | {"COHAPTIC_CACHE": folder},
                stdout=subprocess.PIPE,
                text=True,
                check=True,
            )
            body, *sizes = done.stdout.split()[-4 if what == "--one" else -2 :]
            if store == "floor":
                filling, factoring = float(body), float(sizes[0])
                print(f"{store:>7} fTetWild {filling:.2f} s, SuperLU {factoring:.2f} s")
                results.append({"store": store, "filling_s": filling, "factoring_s": factoring})
                continue
            whole = time.perf_counter() - begin
            print(f"{store:>7} {whole:>6.2f} s {float(body):>6.2f} s  {', '.join(sizes)}")
            tetrahedra, vertices, megabytes = map(int, sizes)
            results.append(
                {
                    "store": store,
                    "all_s": whole,
                    "body_s": float(body),
                    "tetrahedra": tetrahedra,
                    "surface_vertices": vertices,
                    "factor_bytes": 1_000_000 * megabytes,
                }
            )
    json_report.write(options, results)


if __name__ == "__main__":
    main()
