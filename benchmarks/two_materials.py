"""Objects of two materials from files beside closed solutions: a bar in series, a layered beam.

    python benchmarks/two_materials.py [--cases series layers] [--edges 3] [--json FILE]

Each is a GLB with two nodes that touch, built with a stiffness and a Poisson's ratio for each as
`cohaptic serve --body` builds it; columns as in `closed_solutions.py`. `inclusion` is a soft block
in a stiff one, pressed above it. It has no closed solution and is compared with the same object on
a grid that follows both blocks and never was a file.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import quad

import closed_solutions
from closed_forms import Hooke
from closed_solutions import Case
from cohaptic_server.bodies.body import Load
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.surface import SurfaceMesh, face_area_vectors
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.materials import PartMaterials
from graded_block import BOX, INSIDE, RADIUS, reference
from loaded_disc import pressed
from shapes.grids import Mesh
from shapes.scene_files import parts_glb
from shapes.solids import plate

STIFF, SOFT = Hooke(2e5, 0.3), Hooke(2e4, 0.4)
BAR = (0.2, 0.02, 0.02)  # m
HELD = 0.1  # of its length
_TIP = 0.19  # m, where the layered beam is pressed
MIDDLE = 0.5  # of the bar's length, and of the beam's height, where the materials meet


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Mesh:
    """A box of twelve triangles between two corners [m]."""
    x, faces = plate(1.0, 1.0, 1)
    return np.array(low) + (x + np.array([0.5, 0.5, 0.0])) * (np.array(high) - np.array(low)), faces


def written(
    name: str, parts: dict[str, Mesh], fix: str, radius: float
) -> Callable[[Path], ObjectFile]:
    """Writes parts called `stiff` and `soft` into a folder, and names their materials."""

    def write(folder: Path) -> ObjectFile:
        path = folder / f"{name}.glb"
        path.write_bytes(parts_glb(parts))
        materials = PartMaterials(
            young=(("stiff", STIFF.young), ("soft", SOFT.young)),
            nu=(("stiff", STIFF.nu), ("soft", SOFT.nu)),
        )
        return ObjectFile(path, fix, material=SolidSettings(contact_radius=radius), parts=materials)

    return write


def series(folder: Path) -> ObjectFile:
    """A bar whose near half is stiff and whose far half is soft."""
    (length, width, height), at = BAR, MIDDLE * BAR[0]
    halves = {
        "stiff": box((0.0, 0.0, 0.0), (at, width, height)),
        "soft": box((at, 0.0, 0.0), (length, width, height)),
    }
    return written("series", halves, f"x < {HELD:.0%}", 0.006)(folder)


def end_load(mesh: SurfaceMesh, axis: int) -> Load:
    """An even traction of 1 N on the face at the upper end of an axis, along it."""
    corners = mesh.vertices[mesh.faces][:, :, axis]
    # Filling keeps a flat end within a thousandth of the object.
    faces = mesh.faces[corners.min(axis=1) > corners.max() - 2e-3 * mesh.size]
    areas = np.linalg.norm(face_area_vectors(mesh.vertices, faces), axis=1)
    weights = np.bincount(faces.ravel(), np.repeat(areas / 3.0, 3), len(mesh.vertices))
    loaded = np.flatnonzero(weights)
    return Load(loaded, weights[loaded] / weights.sum(), np.eye(3)[axis], 1.0)


def stretched(solid: Solid) -> float:
    """Compliance of the end of the bar under an even traction [m/N]."""
    return float(solid.respond([end_load(solid.mesh, 0)]).compliance[0, 0])


def in_series() -> float:
    """Each length over its modulus and section [m/N]."""
    length, width, height = BAR
    parts = (MIDDLE - HELD) / STIFF.young + (1.0 - MIDDLE) / SOFT.young
    return length * parts / (width * height)


def layers(folder: Path) -> ObjectFile:
    """A beam whose lower half is soft and whose upper half is stiff."""
    (length, width, height), at = BAR, MIDDLE * BAR[2]
    halves = {
        "soft": box((0.0, 0.0, 0.0), (length, width, at)),
        "stiff": box((0.0, 0.0, at), (length, width, height)),
    }
    return written("layers", halves, f"x < {HELD:.0%}", 0.006)(folder)


def tip(solid: Solid) -> float:
    """Compliance at the tip [m/N]."""
    return float(pressed(solid, (_TIP, 0.5 * BAR[1], BAR[2]))[0, 0])


def layered_beam() -> float:
    """Bending about the elastic axis, and shear by the stress that equilibrium gives [m/N].

    With E(z), z from the elastic axis and S(z) the integral of E z above, the shear stress is
    F S / (b D) with the bending stiffness D / b = integral of E z^2, and its energy gives the
    compliance in shear (Jourawski); 6/5 of L / (G A) where there is one material.
    """
    _, width, height = BAR
    at, length = MIDDLE * height, _TIP - HELD * BAR[0]

    def young(z: float) -> float:
        return SOFT.young if z < at else STIFF.young

    def integral(weight: Callable[[float], float], low: float = 0.0) -> float:
        return float(quad(weight, low, height, points=[max(low, at)])[0])

    axis = integral(lambda z: young(z) * z) / integral(young)
    D = integral(lambda z: young(z) * (z - axis) ** 2)

    def sheared(z: float) -> float:
        S = integral(lambda above: young(above) * (above - axis), z)
        return S**2 / (SOFT if z < at else STIFF).shear

    return length**3 / (3.0 * width * D) + length * integral(sheared) / (width * D**2)


def inclusion(folder: Path) -> ObjectFile:
    """A soft block in a stiff one."""
    parts = {"stiff": box(*BOX), "soft": box(*INSIDE)}
    return written("inclusion", parts, "z < 10%", RADIUS)(folder)


def above(solid: Solid) -> float:
    """Compliance above the soft block [m/N]."""
    return float(pressed(solid, (0.0, 0.0, BOX[1][2]))[0, 0])


CASES: dict[str, Case] = {
    "series": Case(series, (0.1, 0.05, 0.03, 0.02), stretched, in_series()),
    "layers": Case(layers, (0.1, 0.05, 0.03, 0.02), tip, layered_beam()),
}


def main() -> None:
    """Compare all of them."""
    cases = dict(CASES)
    if len(sys.argv) == 1 or "inclusion" in sys.argv:  # its reference takes a minute
        edges = (0.1, 0.07, 0.05, 0.035)
        cases["inclusion"] = Case(inclusion, edges, above, reference(STIFF, SOFT))
    closed_solutions.main(cases, __doc__)


if __name__ == "__main__":
    main()
