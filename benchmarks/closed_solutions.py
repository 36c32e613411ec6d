"""Objects from files beside closed solutions: a cantilever, a layer, a clamped plate.

    python benchmarks/closed_solutions.py [--cases cantilever plate] [--edges 3] [--json FILE]
        [--picture FILE.svg]

Each is written to a file as a user has it and built as `cohaptic serve --body` builds it: read,
scaled, filled by fTetWild, cut where its rule or second surface holds it, factored, stored. A press
of a fingertip then gives the compliance; under a rigid punch the pressure is a sum of three terms
that makes the depth even. `size` is the edge of a regular tetrahedron of the mean volume. The limit
for size zero and the order are those of C + c size^p through the last three meshes (Richardson);
fTetWild's meshes are not nested, so the order is a rough one.
"""

# pyright: reportUnknownMemberType=false
# (matplotlib's signatures leave their keywords open.)

from __future__ import annotations

import math
import os
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import clamped_plates
import closed_forms
import json_report
import plate_theory
from clamped_plates import CLAMP, TOUCH
from closed_forms import Hooke
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.objects.build import build
from cohaptic_server.objects.object_file import ObjectFile
from loaded_disc import disc_load, pressed
from shapes.solids import plate
from shapes.surface_files import ply, stl

HOOKE = Hooke(1e5, 0.3)
_REGULAR = 6.0 * math.sqrt(2.0)  # cube of the edge of a regular tetrahedron over its volume
_TERMS = 3  # of the pressure under a rigid punch
_COLUMNS = (
    ("case", "{}"),
    ("edge", "{:g}"),
    ("size_m", "{:.2e}"),
    ("tetrahedra", "{:,}"),
    ("found", "{:.5g}"),
    ("exact", "{:.5g}"),
    ("error", "{:+.2%}"),
    ("seconds", "{:.1f}"),
)


@dataclass(frozen=True)
class Case:
    """A file and its closed solution.

    Args:
        write: Writes the files into a folder; gives the object without an edge.
        edges: `--edge`, the coarsest first.
        measure: Measure of the solid: what is compared.
        exact: The closed solution.
    """

    write: Callable[[Path], ObjectFile]
    edges: tuple[float, ...]
    measure: Callable[[Solid], float]
    exact: float


BEAM = (0.2, 0.02, 0.02)  # m
_TIP = 0.19  # m, where the beam is pressed


def beam(folder: Path) -> ObjectFile:
    """A bar of twelve triangles in millimetres, held over the first tenth of its length."""
    x, faces = plate(1.0, 1.0, 1)
    path = folder / "beam.stl"
    path.write_bytes(stl(((x + np.array([0.5, 0.0, 0.0])) * BEAM * 1e3, faces), "millimetres"))
    settings = SolidSettings(HOOKE.young, HOOKE.nu, contact_radius=0.006)
    return ObjectFile(path, "x < 10%", scale=1e-3, material=settings)


def tip(solid: Solid) -> float:
    """Compliance at the tip [m/N]."""
    return float(pressed(solid, (_TIP, 0.0, BEAM[2]))[0, 0])


FINGER = 0.02  # m, radius of the pressure on a slab and of the rigid punch
# Width and height in contact radii. On a layer the surface beside a press falls off with its
# thickness: free sides as far away change a block by 0.1 % (docs/design/solid.md).
SLAB, SHEET = (8.0, 2.0), (4.5, 0.625)
LAYER = 0.8  # of the height is not held


def slab(shape: tuple[float, float]) -> Callable[[Path], ObjectFile]:
    """A square slab, held over the lowest fifth of its height."""
    width, height = FINGER * shape[0], FINGER * shape[1]

    def write(folder: Path) -> ObjectFile:
        path = folder / f"slab_{shape[1]:g}.ply"
        path.write_bytes(ply(plate(height, width, 6)))
        settings = SolidSettings(HOOKE.young, HOOKE.nu, contact_radius=FINGER)
        return ObjectFile(path, "z < 20%", material=settings)

    return write


def dent(solid: Solid) -> float:
    """Compliance in the middle of the thick slab [m/N]."""
    return float(pressed(solid, (0.0, 0.0, FINGER * SLAB[1]))[0, 0])


def rigid(solid: Solid) -> float:
    """Stiffness under a flat rigid punch in the middle of the thin slab [N/m]."""
    height = FINGER * SHEET[1]
    loads = [disc_load(solid.mesh, height, FINGER, k - 0.5) for k in range(_TERMS)]
    C = solid.respond(loads).compliance
    return float(np.linalg.solve(C, np.ones(_TERMS)).sum())


PLATE = 0.005  # m, thickness
_PLATE_EDGES = (0.05, 0.035, 0.025, 0.018)
CASES: dict[str, Case] = {
    "cantilever": Case(
        beam,
        (0.1, 0.05, 0.03, 0.02),
        tip,
        closed_forms.cantilever(HOOKE, _TIP - 0.1 * BEAM[0], BEAM[2]),
    ),
    "fingertip": Case(
        slab(SLAB),
        (0.1, 0.07, 0.05, 0.035),
        dent,
        closed_forms.layer(HOOKE, LAYER * SLAB[1] * FINGER, FINGER),
    ),
    "punch": Case(
        slab(SHEET),
        (0.08, 0.05, 0.035, 0.025),
        rigid,
        closed_forms.punch(HOOKE, LAYER * SHEET[1] * FINGER, FINGER),
    ),
    "plate": Case(
        clamped_plates.round_plate(HOOKE, PLATE),
        _PLATE_EDGES,
        clamped_plates.bend(PLATE),
        closed_forms.clamped_plate(HOOKE, CLAMP, PLATE, TOUCH),
    ),
    "thin plate": Case(
        clamped_plates.round_plate(HOOKE, 0.5 * PLATE),
        _PLATE_EDGES,
        clamped_plates.bend(0.5 * PLATE),
        closed_forms.clamped_plate(HOOKE, CLAMP, 0.5 * PLATE, TOUCH),
    ),
    "square plate": Case(
        clamped_plates.square_plate(HOOKE, PLATE),
        _PLATE_EDGES,
        clamped_plates.bend(PLATE),
        plate_theory.square_plate(HOOKE, CLAMP, PLATE, TOUCH),
    ),
    "thin square plate": Case(
        clamped_plates.square_plate(HOOKE, 0.5 * PLATE),
        _PLATE_EDGES,
        clamped_plates.bend(0.5 * PLATE),
        plate_theory.square_plate(HOOKE, CLAMP, 0.5 * PLATE, TOUCH),
    ),
}


def limit(sizes: list[float], values: list[float]) -> tuple[float, float]:
    """Value for size zero and order of convergence of three values, the coarsest first.

    Args:
        sizes: Falling sizes of the elements.
        values: What was found with them.

    Returns:
        The last value and not a number where the three do not approach anything.
    """
    (a, b, c), (u, v, w) = sizes[-3:], values[-3:]

    def off(p: float) -> float:
        return float((u - v) * (b**p - c**p) - (v - w) * (a**p - b**p))

    if off(0.2) * off(8.0) >= 0.0:
        return w, math.nan
    p = float(brentq(off, 0.2, 8.0))
    return w - (v - w) * c**p / (b**p - c**p), p


def run(
    case: str, edge: float, folder: Path, cases: Mapping[str, Case] = CASES
) -> json_report.Result:
    """Write, build and press one object.

    Args:
        case: One of the cases.
        edge: `--edge`.
        folder: For its files.
        cases: By their names.
    """
    chosen = cases[case]
    source = chosen.write(folder)
    start = time.process_time()
    solid = build(replace(source, edge=edge)).solid
    found = chosen.measure(solid)
    tets = solid.shape.tets
    return {
        "case": case,
        "edge": edge,
        "size_m": (_REGULAR * tets.volume / len(tets.tets)) ** (1.0 / 3.0),
        "tetrahedra": len(tets.tets),
        "found": found,
        "exact": chosen.exact,
        "error": found / chosen.exact - 1.0,
        "seconds": time.process_time() - start,
    }


def draw(path: Path, results: list[json_report.Result]) -> None:
    """Draw the error of each case over the number of tetrahedra."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
    for case in dict.fromkeys(str(row["case"]) for row in results):
        rows = [row for row in results if row["case"] == case and "edge" in row]
        if rows:
            counts = [float(row["tetrahedra"] or 0.0) for row in rows]
            errors = [100.0 * float(row["error"] or 0.0) for row in rows]
            axes.semilogx(counts, errors, "o-", label=case)
    axes.axhspan(-3.0, 3.0, color="0.92")
    axes.set(xlabel="tetrahedra", ylabel="error of the stiffness or compliance, %")
    axes.legend(frameon=False)
    plt.rcParams["svg.hashsalt"] = "cohaptic"
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


def main(cases: Mapping[str, Case] = CASES, words: str | None = __doc__) -> None:
    """Print a table, and the limit of each case."""
    parser = json_report.parser(words)
    parser.add_argument("--cases", nargs="+", choices=tuple(cases), default=tuple(cases))
    parser.add_argument("--edges", type=int, default=4, help="how many of the edges, from 1 to 4")
    parser.add_argument("--picture", type=Path, help="draw the errors to this file")
    options = parser.parse_args()
    results: list[json_report.Result] = []
    with tempfile.TemporaryDirectory() as scratch:
        os.environ["COHAPTIC_CACHE"] = str(Path(scratch) / "store")
        for case in options.cases:
            rows: list[json_report.Result] = []
            for edge in cases[case].edges[: options.edges]:
                rows.append(run(case, edge, Path(scratch), cases))
                print("  ".join(form.format(rows[-1][name]) for name, form in _COLUMNS), flush=True)
            results += rows
            if len(rows) >= 3:
                sizes = [float(row["size_m"] or 0.0) for row in rows]
                value, order = limit(sizes, [float(row["found"] or 0.0) for row in rows])
                off = value / cases[case].exact - 1.0
                print(f"{case}: limit {value:.5g}, {off:+.2%} off, order {order:.1f}")
                results.append({"case": case, "limit": value, "limit_error": off, "order": order})
    json_report.write(options, results)
    if options.picture is not None:
        draw(options.picture, results)


if __name__ == "__main__":
    main()
