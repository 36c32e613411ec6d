"""Time that a server takes to load an object from a file, with an empty store and a full one.

    python benchmarks/object_start.py [FILE] [--fix "z < 15%"] [--edge 0.05] [--json FILE]

Every start is a process of its own: `body` is from its first line to a solid that answers, `all`
with Python and its libraries. The store is a folder that is gone afterwards. The first start after
another one finds the file in the system's memory; one after days reads it from the disk.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import json_report
from cohaptic_server.objects.build import build_solid
from cohaptic_server.objects.object_file import ObjectFile

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


def main() -> None:
    """Start with an empty store and twice with a full one, and print the times."""
    parser = json_report.parser(__doc__)
    parser.add_argument("file", type=Path, nargs="?", default=ORGAN)
    parser.add_argument("--fix", default="z < 15%")
    parser.add_argument("--edge", type=float, default=0.05)
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        start(options.file, options.fix, options.edge)
        return
    print(f"{'store':>7} {'all':>8} {'body':>8}  tetrahedra, vertices of surface, MB of factor")
    results: list[json_report.Result] = []
    with tempfile.TemporaryDirectory() as folder:
        for store in ("empty", "full", "full"):
            begin = time.perf_counter()
            arguments = [str(options.file), "--fix", options.fix, "--edge", str(options.edge)]
            done = subprocess.run(
                [sys.executable, __file__, "--one", *arguments],
                env=os.environ | {"COHAPTIC_CACHE": folder},
                stdout=subprocess.PIPE,
                text=True,
                check=True,
            )
            body, *sizes = done.stdout.split()
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
