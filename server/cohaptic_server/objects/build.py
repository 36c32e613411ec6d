"""Builds a solid body from a file in one chain: read, check, fill, fix, factor, survey.

Reading, checking and filling give tetrahedra (`prepare.py`). They are made finer where the object
is thin (`mesh/thin_parts.py`). The options select the fixed part, and the tetrahedra are cut where
it ends (`fix_rule.py`). Then the stiffness is factored, and the survey presses the solid all over
its surface (`bodies/solid/parts.py`). The store keeps the tetrahedra as filling made them, and the
results of the last two steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from cohaptic.clock import SystemClock
from cohaptic.errors import one_line
from cohaptic_server.bodies.solid.parts import plan_of_solid
from cohaptic_server.bodies.solid.shape import Moduli, shape_of
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.cholesky.plan import Plan
from cohaptic_server.mesh.thin_parts import finer_where_thin
from cohaptic_server.objects.cost import Cost, check_memory, cost_of, multiplications
from cohaptic_server.objects.fix_rule import Cut, check_fix_given, hold
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.parts import Parts
from cohaptic_server.objects.prepare import Prepared
from cohaptic_server.objects.store.store import load_or_make_parts, load_or_prepare
from cohaptic_server.progress import Progress

# Number of tetrahedra up to which thin parts are made finer at the default edge: factoring them
# takes about 0.6 GB and 5 s. An object with more tetrahedra already has a fine mesh.
_MAX_FINE, _DEFAULT_EDGE = 12_000, 0.05


@dataclass(frozen=True, eq=False)
class Built:
    """A solid together with the tetrahedra that it was made from.

    Args:
        prepared: Tetrahedra of the file, and the report on its surface.
        parts: Parts of the solid's tetrahedra; None if the file has no parts.
        cost: Expected memory and time of factoring; None if the factor came from the store.
    """

    solid: Solid
    prepared: Prepared
    parts: Parts | None = None
    cost: Cost | None = None


def build(
    source: ObjectFile,
    progress: Progress = lambda phase, fraction: None,
    *,
    late: bool = False,
) -> Built:
    """Build the solid body of a file; results of slow steps come from the store if it has them.

    Args:
        progress: Called with the phase and the share of it that is done.
        late: Whether a stored factor is read when it is first needed, and not now.

    Raises:
        BodyError: The file does not hold an object that can be touched.
        SettingError: An option does not fit the file.
    """
    check_fix_given(source)
    progress("tetrahedra", 0.0)
    prepared = load_or_prepare(source, progress)
    held = held_finely(source, prepared)
    moduli = moduli_of(source, prepared, held)
    # Beside other work on the same cores two BLAS threads wait for each other: 32 solves of an
    # organ of 9,000 quadratic tetrahedra took 8.5 s instead of 0.2 s (docs/design/loop.md).
    with threadpool_limits(limits=1):
        costs: list[Cost] = []

        def accept(plan: Plan) -> None:
            costs.append(cost_of(plan, multiplications(SystemClock())))
            check_cost(source, prepared, costs[0])

        def report(phase: str, fraction: float) -> None:
            words = f", {costs[0].words()}" if costs and phase != "storing" else ""
            progress(phase + words, fraction)

        tets = held.tets.centred()  # users reach an object wherever it lies in its file
        parts = load_or_make_parts(
            tets, held.fixed, source.material, report, accept, late=late, moduli=moduli
        )
    name = one_line(source.path.stem, 40)
    solid = Solid(tets, held.fixed, source.material, name=name, parts=parts)
    named = None if prepared.parts is None else prepared.parts.of_elements(held.parent)
    return Built(solid, prepared, named, *costs)


def held_finely(source: ObjectFile, prepared: Prepared) -> Cut:
    """Make tetrahedra of a linear solid finer where it is thin, and cut them at its held region.

    A volume mesh is only cut. A nonlinear solid is not made finer either, since each tick factors
    its mesh; `build_rubber.py` only cuts it.

    Raises:
        BodyError: Too little of the object is held.
        SettingError: The rule for the held region does not fit the object.
    """
    if prepared.surface is None:
        return hold(source, prepared.tets)
    diagonal = float(np.linalg.norm(np.ptp(prepared.tets.vertices, axis=0)))
    # The number of elements in a layer falls with the square of the edge. At shorter edges thin
    # parts are resolved already, and the limit grows with 1 / edge only: more elements would take
    # memory that the requested edge itself needs.
    finer = _DEFAULT_EDGE / source.edge
    limit = round(_MAX_FINE * min(finer, finer**2))
    cut = finer_where_thin(prepared.tets, source.edge * diagonal, limit)
    held = hold(source, cut.tets)
    return replace(held, parent=cut.parent[held.parent])


def moduli_of(source: ObjectFile, prepared: Prepared, held: Cut) -> Moduli:
    """Elastic moduli of each tetrahedron after the cut: those of the part that it lies in.

    Raises:
        SettingError: A material names a part that does not exist, or a part has no material.
        BodyError: The stiffest part is too stiff for the softest one.
    """
    return source.parts.moduli(source.material, prepared.parts, held.parent)


def expected_cost(source: ObjectFile, prepared: Prepared) -> Cost:
    """Estimate the memory and time that making a solid of the prepared tetrahedra takes.

    Raises:
        BodyError: Too little of the object is held.
        SettingError: The rule for the held region does not fit the object.
    """
    held = held_finely(source, prepared)
    plan = plan_of_solid(shape_of(held.tets, held.fixed, source.material))
    return cost_of(plan, multiplications(SystemClock()))


def check_cost(source: ObjectFile, prepared: Prepared, cost: Cost) -> None:
    """Check that an object can be factored within the memory limit of its options.

    Raises:
        TooCostlyError: Factoring takes more memory.
    """
    edge = None if prepared.surface is None else source.edge
    order = source.material.order
    what = f"{source.path}: {len(prepared.tets.tets):,} tetrahedra of order {order}"
    check_memory(cost, source.max_memory, what, edge, order)


def build_solid(
    source: ObjectFile,
    progress: Progress = lambda phase, fraction: None,
    *,
    late: bool = False,
) -> Solid:
    """Build the solid body of a file, as `build` does, and return it alone."""
    return build(source, progress, late=late).solid
