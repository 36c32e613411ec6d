"""A file becomes a nonlinear solid, of a mesh that a tick can afford."""

from __future__ import annotations

import math
from dataclasses import replace

from cohaptic.errors import BodyError
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid, tick_seconds
from cohaptic_server.mesh.tetrahedra import TetMesh, quadratic
from cohaptic_server.objects.fix_rule import check_said, held_in
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store.store import prepared
from cohaptic_server.objects.volume_file import VOLUMES
from cohaptic_server.progress import Progress

# Tried in turn where the user names none; a surface of many bends needs the longer ones.
EDGES = (0.15, 0.2, 0.25, 0.3, 0.4, 0.5)


def build_rubber_solid(
    wanted: ObjectFile,
    *,
    period: float,
    damping: float = 0.0,
    progress: Progress = lambda phase, share: None,
) -> RubberSolid:
    """The nonlinear solid of a file.

    Args:
        wanted: The file; with the usual edge it gets the first of `EDGES` that a tick can afford.
        period: Of the simulation [s].
        damping: B_o over K_o of eq. (9).
        progress: Is told the phase.

    Raises:
        BodyError: The file is no object that can be touched, or too fine for the period.
        SettingError: An option does not fit it.
    """
    check_said(wanted)
    progress("tetrahedra", 0.0)
    tets = _affordable(wanted, period)
    held = held_in(wanted, tets.vertices)
    name = wanted.path.stem[:40]
    return RubberSolid(tets, held, wanted.material, name, damping=damping)


def _affordable(wanted: ObjectFile, period: float) -> TetMesh:
    volume = wanted.path.suffix.lower() in VOLUMES
    usual = wanted.edge == ObjectFile(wanted.path).edge
    edges = EDGES if usual and not volume else (wanted.edge,)
    nodes = 0
    for edge in edges:
        tets = prepared(replace(wanted, edge=edge)).tets
        nodes = len(quadratic(tets)[0]) if wanted.material.order == 2 else len(tets.vertices)
        if tick_seconds(nodes) <= period:
            return tets
    expected = tick_seconds(nodes)
    ways = ["a coarser mesh" if volume else f"a larger --edge than {edges[-1]:g}"]
    if expected <= 0.1:
        ways.append(f"--simulation-hz {math.floor(1.0 / expected)}")
    raise BodyError(
        f"{wanted.path}: {nodes:,} nodes under large deformation take about {1e3 * expected:.3g} ms"
        f" in each tick, and {1.0 / period:g} Hz leave {1e3 * period:.3g} ms. Take"
        f" {' or '.join(ways)}; or leave out --nonlinear"
    )
