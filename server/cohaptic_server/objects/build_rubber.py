"""Builds a nonlinear solid from a file, on a mesh coarse enough to be solved in every tick."""

from __future__ import annotations

import math
from dataclasses import astuple, replace
from pathlib import Path

from cohaptic.errors import BodyError, one_line
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.solid.shape import Moduli
from cohaptic_server.mesh.tetrahedra import TetMesh, quadratic
from cohaptic_server.objects.build import moduli_of
from cohaptic_server.objects.cost import Demand
from cohaptic_server.objects.fix_rule import Cut, check_fix_given, hold
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.parts import VolumeLostError
from cohaptic_server.objects.prepare import Prepared
from cohaptic_server.objects.store.cache import entry_path, load_entry, save_entry
from cohaptic_server.objects.store.store import at_default_young, load_or_prepare
from cohaptic_server.progress import Progress
from cohaptic_server.touchable import VOLUMES

_FORM = 1  # version of the stored presses; raised when they are computed in another way
# Edges that are tried in this order if the user gives none, as shares of the bounding box's
# diagonal; a strongly curved surface needs the longer ones.
EDGES = (0.15, 0.2, 0.25, 0.3, 0.4, 0.5)
FINER = (0.1, 0.07, 0.05)  # tried next if all of `EDGES` lose thin parts


class TooFineError(BodyError):
    """No mesh of a file has few enough nodes to be solved within a tick.

    Args:
        nodes: Number of nodes of the coarsest mesh.
        demand: Number of users and tick rate, whose period is too short for this mesh.
        ways: Options with which a tick could solve the object.

    Attributes:
        problem: The fault, as the beginning of a sentence.
        ways: Options with which a tick could solve the object.
    """

    def __init__(self, source: ObjectFile, nodes: int, demand: Demand, ways: list[str]) -> None:
        expected = demand.expected_tick(nodes)
        self.ways = ways
        self.problem = (
            f"{nodes:,} nodes under large deformation take about {1e3 * expected:.3g} ms in each"
            f" tick, and {demand.hz:g} Hz leave {1e3 * demand.period:.3g} ms"
        )
        super().__init__(
            f"{source.path}: {self.problem}. Take {' or '.join(ways)}; or leave out --nonlinear"
        )


def build_rubber_solid(
    source: ObjectFile,
    *,
    demand: Demand,
    damping: float = 0.0,
    progress: Progress = lambda phase, fraction: None,
) -> RubberSolid:
    """Build the nonlinear solid of a file.

    Args:
        source: The file and its options. The default edge is replaced by the first of `EDGES`, or
            else of `FINER`, whose mesh can be solved within a tick.
        demand: Number of users and tick rate.
        damping: B_o over K_o of eq. (9).
        progress: Called with the phase and the share of it that is done.

    Raises:
        BodyError: The file does not hold an object that can be touched, or its mesh is too fine.
        SettingError: An option does not fit the file.
    """
    return build_affordable(source, demand=demand, damping=damping, progress=progress)[1]


def build_affordable(
    source: ObjectFile,
    *,
    demand: Demand,
    damping: float = 0.0,
    progress: Progress = lambda phase, fraction: None,
) -> tuple[ObjectFile, RubberSolid]:
    """Build the nonlinear solid of a file; also return its options with the chosen edge length."""
    check_fix_given(source)
    progress("tetrahedra", 0.0)
    source, prepared, held = affordable(source, demand, progress)
    moduli = moduli_of(source, prepared, held)
    name = one_line(source.path.stem, 40)
    # The compliance at rest is in proportion to 1 / E, and one table is kept for every E.
    stored, multiple = at_default_young(moduli)
    path = _table_path(source, held, stored, damping)
    kept = load_entry(path, "presses", mapped=False) or {}
    table = kept["table"] / multiple if "table" in kept else None
    solid = RubberSolid(
        held.tets.centred(),
        held.fixed,
        source.material,
        name,
        damping=damping,
        table=table,
        moduli=moduli,
    )
    # A server and a caller that places hands both need the table; pressing a thin part takes half a
    # minute.
    pressed = solid.vertex_compliance(lambda fraction: progress("pressing", fraction))
    if not kept:
        save_entry(path, "presses", {"table": pressed * multiple})
    return source, solid


def _table_path(source: ObjectFile, held: Cut, moduli: Moduli, damping: float) -> Path:
    """Path of the entry with the compliance at each vertex."""
    young = float(moduli.young[0]) if moduli.is_uniform else source.material.young
    material = replace(source.material, young=young)
    options = repr((_FORM, *astuple(material), damping)).encode()
    arrays = (held.tets.vertices, held.tets.tets, held.fixed, moduli.young, moduli.nu)
    return entry_path(options, *(array.tobytes() for array in arrays))


def affordable(
    source: ObjectFile, demand: Demand, progress: Progress
) -> tuple[ObjectFile, Prepared, Cut]:
    """Find an edge whose mesh a tick can solve; return options with it, the mesh, and its cut.

    Raises:
        VolumeLostError: Every mesh that was tried loses too much of the object.
        TooFineError: The meshes that keep enough of the object are too fine for a tick.
        BodyError: The file does not hold an object that can be touched.
        SettingError: An option does not fit the file.
    """
    order, is_volume = source.material.order, source.path.suffix.lower() in VOLUMES
    is_default_edge = source.edge == ObjectFile(source.path).edge
    edges = EDGES if is_default_edge and not is_volume else (source.edge,)
    lost: VolumeLostError | None = None
    coarsest: tuple[ObjectFile, Prepared, Cut] | None = None
    for edge in edges + FINER if edges is EDGES else edges:
        if edge < edges[0] and coarsest is not None:
            break  # a finer mesh helps only if all coarser ones lost thin parts
        tried = replace(source, edge=edge)
        try:
            prepared = load_or_prepare(tried, progress)
        except VolumeLostError as error:
            lost = lost or error
            continue
        coarsest = tried, prepared, hold(source, prepared.tets)
        if demand.affords(_nodes(coarsest[2].tets, order)):
            return coarsest
    if coarsest is None:
        assert lost is not None
        raise lost
    tried, _, held = coarsest
    ways = ["a coarser mesh"] if is_volume else []
    if not is_volume and tried.edge < EDGES[-1]:
        ways = [f"a larger --edge than {tried.edge:g}{', which loses thin parts,' if lost else ''}"]
    if order == 2 and demand.affords(_nodes(held.tets, 1)):
        ways.append("--order 1")
    nodes = _nodes(held.tets, order)
    expected = demand.expected_tick(nodes)
    if demand.users > 2 and replace(demand, users=2).affords(nodes):
        ways.append("fewer --users")
    if expected <= 0.1:
        ways.append(f"--simulation-hz {math.floor(1.0 / expected)}")
    raise TooFineError(source, nodes, demand, ways or ["a simpler object"])


def _nodes(tets: TetMesh, order: int) -> int:
    return len(quadratic(tets)[0]) if order == 2 else len(tets.vertices)
