"""What preparing an object from a file cannot do without, by libraries alone.

    python benchmarks/preparation_floor.py [FILE] [--fix "z < 15%"] [--edge 0.05] [--json FILE]

One run of fTetWild on the same surface, and one factorisation of the same stiffness by SuperLU
(scipy, which has no other direct solver; unsymmetric, so with twice the arithmetic of Cholesky).
The tetrahedra are those of the store, since fTetWild makes others each time. `object_start.py` has
what the product takes.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from pytetwild.pytetwild import tetrahedralize
from scipy.sparse.linalg import splu

import json_report
from cohaptic_server.bodies.solid.parts import stiffness_of
from cohaptic_server.bodies.solid.shape import shape_of
from cohaptic_server.objects.fix_rule import hold
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store.store import load_or_prepare
from cohaptic_server.objects.surface.surface_file import read_surface
from cohaptic_server.objects.tetrahedralise import envelope
from object_start import ORGAN


def main() -> None:
    """Print the seconds of one run of fTetWild, and of one factorisation by SuperLU."""
    parser = json_report.parser(__doc__)
    parser.add_argument("file", type=Path, nargs="?", default=ORGAN)
    parser.add_argument("--fix", default="z < 15%")
    parser.add_argument("--edge", type=float, default=0.05)
    options = parser.parse_args()
    source = ObjectFile(options.file, options.fix, edge=options.edge)
    x, faces = read_surface(options.file)
    begin = time.perf_counter()
    tetrahedralize(
        x,
        faces.astype(np.int32),
        edge_length_fac=options.edge,
        epsilon=envelope(options.edge),
        num_threads=1,
    )
    filling = time.perf_counter() - begin
    held = hold(source, load_or_prepare(source).tets)
    shape = shape_of(held.tets, held.fixed, source.material)
    free = np.flatnonzero(~np.repeat(shape.fixed, 3))
    matrix = sp.csc_matrix(stiffness_of(shape)[free][:, free])
    begin = time.perf_counter()
    splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    factoring = time.perf_counter() - begin
    print(f"fTetWild {filling:.2f} s, SuperLU {factoring:.2f} s")
    json_report.write(options, [{"filling_s": filling, "factoring_s": factoring}])


if __name__ == "__main__":
    main()
