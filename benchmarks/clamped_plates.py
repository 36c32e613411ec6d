"""Clamped plates in files, round and square, each held by a second surface; and their press."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from closed_forms import Hooke
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.numeric import Floats
from cohaptic_server.objects.object_file import ObjectFile
from loaded_disc import pressed

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))  # for the files
from shapes.grids import Mesh, moved, periodic, turned
from shapes.scene_files import glb
from shapes.solids import plate
from shapes.surface_files import stl

CLAMP, RIM = 0.05, 0.06  # m: radius or half of the side, where the plate is free and where it ends
TOUCH = 0.008  # m, contact radius on the plate


def annulus(inside: float, outside: float, low: float, high: float, around: int = 120) -> Mesh:
    """A closed ring of rectangular section about z [m]; with four corners a square frame."""
    angle = 2.0 * np.pi * np.arange(around) / around
    # A polygon of the same area as its circle.
    even = math.sqrt(2.0 * math.pi / around / math.sin(2.0 * math.pi / around))
    if around == 4:
        even, angle = math.sqrt(2.0), angle + 0.25 * math.pi
    rings = [
        np.stack([even * r * np.cos(angle), even * r * np.sin(angle), np.full(around, z)], axis=1)
        for r, z in ((inside, low), (outside, low), (outside, high), (inside, high))
    ]
    return np.stack(rings, axis=1).reshape(-1, 3), periodic(around, 4)


def round_plate(material: Hooke, thickness: float) -> Callable[[Path], ObjectFile]:
    """A round plate in a GLB in millimetres."""
    profile = np.array([(0.0, 0.0), (RIM, 0.0), (RIM, thickness), (0.0, thickness)])
    content = glb(
        [moved(turned(profile, 120), (0.0, 0.0, 0.0), 1e3)], [{"mesh": 0, "scale": [1e-3] * 3}]
    )
    return _held("glb", content, 120, material, thickness)


def square_plate(material: Hooke, thickness: float) -> Callable[[Path], ObjectFile]:
    """A square plate of twelve triangles in an STL."""
    x, faces = plate(1.0, 1.0, 1)
    content = stl((x * np.array([2.0 * RIM, 2.0 * RIM, thickness]), faces))
    return _held("stl", content, 4, material, thickness)


def _held(
    kind: str, content: bytes, around: int, material: Hooke, thickness: float
) -> Callable[[Path], ObjectFile]:
    settings = SolidSettings(material.young, material.nu, contact_radius=TOUCH)

    def write(folder: Path) -> ObjectFile:
        name = f"{around}_{1e3 * thickness:g}"
        path, clamp = folder / f"plate_{name}.{kind}", folder / f"clamp_{name}.stl"
        path.write_bytes(content)
        clamp.write_bytes(stl(annulus(CLAMP, 1.2 * RIM, -thickness, 2.0 * thickness, around)))
        return ObjectFile(path, material=settings, fix_mesh=clamp)

    return write


def bend(thickness: float) -> Callable[[Solid], float]:
    """Compliance of a plate in its middle, averaged over both of its sides [m/N].

    The plate theory has one displacement for the whole thickness. Under the finger the pressed side
    is dented and the far one is not.
    """

    def measure(solid: Solid) -> float:
        C: Floats = pressed(solid, (0.0, 0.0, thickness), (0.0, 0.0, 0.0))
        return float(0.5 * (C[0, 0] - C[0, 1]))

    return measure
