"""Every object by the name of its file, and how its bytes are made."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.testing.blocks import block
from cohaptic_server.testing.soft_ring import ring
from shapes import creatures, flawed, solids
from shapes.grids import moved
from shapes.lobes import organ
from shapes.phantom import phantom
from shapes.scene_files import glb, msh, parts_glb, three_mf, vtu
from shapes.surface_files import ascii_stl, off, ply, quad_ply, seamed_obj, stl, strip_ply

_ROWS, _COLUMNS = 40, 20  # of the torus of quadrilaterals
# Each accent is one byte in Latin-1, and no UTF-8.
_LATIN = "K\N{LATIN SMALL LETTER O WITH DIAERESIS}rper \N{LATIN SMALL LETTER E WITH ACUTE}lastique"


def _quads() -> tuple[Floats, Ints]:
    """A torus of quadrilaterals, row by row."""
    x, _ = solids.torus(around=_ROWS, across=_COLUMNS)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(_ROWS), np.arange(_COLUMNS), indexing="ij"))
    there, next_j = (i + 1) % _ROWS, (j + 1) % _COLUMNS
    corners = [i * _COLUMNS + j, there * _COLUMNS + j, there * _COLUMNS + next_j]
    return x, np.stack([*corners, i * _COLUMNS + next_j], axis=1)


def _strips() -> bytes:
    """The same torus, each row of it one strip that closes on itself."""
    x, quads = _quads()
    rows = quads.reshape(_ROWS, _COLUMNS, 4)
    strips = [
        [int(k) for j in range(_COLUMNS + 1) for k in row[j % _COLUMNS][[0, 1]]] for row in rows
    ]
    return strip_ply(x, strips)


def _mirrored() -> bytes:
    """An organ that a node mirrors: its triangles would face inwards."""
    return glb([organ()], [{"mesh": 0, "scale": [-1.0, 1.0, 1.0]}])


def _nested_nodes() -> bytes:
    """An organ in millimetres, three nodes deep: scaled, turned and moved."""
    half = math.sqrt(0.5)
    return glb(
        [moved(organ(), (0.0, 0.0, 0.0), 1000.0)],
        [
            {"children": [1], "scale": [0.001, 0.001, 0.001]},
            {"children": [2], "rotation": [half, 0.0, 0.0, half]},
            {"mesh": 0, "translation": [100.0, -50.0, 30.0]},
        ],
    )


def _parts() -> bytes:
    """An organ with a tumour of 24 mm in it."""
    x, faces = solids.ball()
    small = x - x.mean(axis=0)
    small *= 0.012 / np.linalg.norm(small, axis=1).max()
    around = organ()
    at = around[0].mean(axis=0) + np.array([0.01, 0.0, 0.008])
    return parts_glb({"organ": around, "tumour": (small + at, faces)})


MANY: dict[str, Callable[[], bytes]] = {
    "animal.ply": lambda: ply(creatures.animal()),
    "block.vtu": lambda: vtu(block((0.1, 0.08, 0.06), (8, 6, 5))),
    "bottle.stl": lambda: stl(solids.bottle()),
    "bowl.stl": lambda: stl(flawed.bowl()),
    "cone.stl": lambda: stl(solids.cone()),
    "crossing.stl": lambda: stl(flawed.crossing()),
    "cube.stl": lambda: stl(solids.cube()),
    "duplicate.ply": lambda: ply(flawed.duplicate()),
    "figure.ply": lambda: ply(creatures.figure()),
    "flipped.ply": lambda: ply(flawed.flipped()),
    "gear.stl": lambda: stl(solids.gear()),
    "huge.stl": lambda: stl(flawed.huge(), "cohaptic example, millimetres"),
    "inside_out.off": lambda: off(flawed.inside_out()),
    "knot.stl": lambda: stl(solids.knot()),
    "latin_1.stl": lambda: ascii_stl(solids.ball(), _LATIN, "latin-1"),
    "leaflet.stl": lambda: stl(flawed.leaflet()),
    "millimetres.3mf": lambda: three_mf(solids.torus()),
    "mirrored.glb": _mirrored,
    "nested.stl": lambda: stl(flawed.nested()),
    "nested_nodes.glb": _nested_nodes,
    "noisy_ball.ply": lambda: ply(solids.noisy_ball()),
    "open_ball.stl": lambda: stl(flawed.open_ball()),
    "organ.ply": lambda: ply(organ()),
    "parts.glb": _parts,
    "phantom.nii.gz": phantom,
    "pile.stl": lambda: stl(flawed.pile()),
    "pinched.stl": lambda: stl(flawed.pinched()),
    "plate.stl": lambda: stl(solids.plate()),
    "quads.ply": lambda: quad_ply(*_quads()),
    "rabbit.ply": lambda: ply(creatures.rabbit()),
    "ring.msh": lambda: msh(ring(36, 10)),
    "rod.stl": lambda: stl(solids.rod()),
    "scan.stl": lambda: stl(solids.scan()),
    "scattered.stl": lambda: stl(flawed.scattered()),
    "seams.obj": lambda: seamed_obj(*_quads(), _COLUMNS),
    "sheet.ply": lambda: ply(flawed.sheet()),
    "strips.ply": _strips,
    "tiny.stl": lambda: stl(flawed.tiny()),
    "torus.stl": lambda: stl(solids.torus()),
    "touching.stl": lambda: stl(flawed.touching()),
}
