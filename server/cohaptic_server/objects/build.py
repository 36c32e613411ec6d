"""From a file to a solid body, in one chain: read, check, fill, fix, factor, survey.

Reading, checking and filling give tetrahedra (`prepare.py`); the options select the fixed part
(`fix_rule.py`), at whose end the tetrahedra are cut (`held_region.py`), finer ones where the object
is thin (`mesh/thin_parts.py`); the stiffness is factored and the surface surveyed by presses all
over it (`bodies/solid/parts.py`). The store keeps the tetrahedra as they were filled and the
results of the last two steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from cohaptic.clock import SystemClock
from cohaptic_server.bodies.solid.moduli import Moduli
from cohaptic_server.bodies.solid.parts import plan_of_solid
from cohaptic_server.bodies.solid.shape import shape_of
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.cholesky.plan import Plan
from cohaptic_server.mesh.thin_parts import finer_where_thin
from cohaptic_server.objects.cost import Cost, check_memory, cost_of, multiplications
from cohaptic_server.objects.fix_rule import check_fix_given, hold
from cohaptic_server.objects.held_region import Cut
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.parts import Parts
from cohaptic_server.objects.prepare import Prepared
from cohaptic_server.objects.store.store import load_or_make_parts, load_or_prepare
from cohaptic_server.progress import Progress

# Tetrahedra up to which thin parts are made finer at the default edge: about 0.6 GB, and 5 s to
# factor. An object that has more has a fine mesh already.
_MOST_FINE, _DEFAULT_EDGE = 12_000, 0.05


@dataclass(frozen=True, eq=False)
class Built:
    """A solid together with the tetrahedra that it was made from.

    Args:
        solid: The body.
        prepared: Its tetrahedra, and the report on the surface in the file.
        parts: Parts of the solid's tetrahedra; None where they have no names in the file.
        cost: What factoring was expected to take; None if that was stored.
    """

    solid: Solid
    prepared: Prepared
    parts: Parts | None = None
    cost: Cost | None = None


def build(
    source: ObjectFile,
    progress: Progress = lambda phase, share: None,
    *,
    late: bool = False,
) -> Built:
    """Build the solid body of a file; the slow steps are loaded from the store if they are there.

    Args:
        source: The file and its options.
        progress: Called with the phase and the share of it that is done.
        late: Whether a stored factor is read when it is first needed, and not now.

    Raises:
        BodyError: The file is no object that can be touched.
        SettingError: An option does not fit it.
    """
    check_fix_given(source)
    progress("tetrahedra", 0.0)
    prepared = load_or_prepare(source, progress)
    held = held_finely(source, prepared)
    moduli = moduli_of(source, prepared, held)
    # Beside other work on the same cores two BLAS threads wait for each other: 32 solves of an
    # organ of 9,000 quadratic tetrahedra took 8.5 s instead of 0.2 s (docs/decisions/0006).
    with threadpool_limits(limits=1):
        costs: list[Cost] = []

        def accept(plan: Plan) -> None:
            costs.append(cost_of(plan, multiplications(SystemClock())))
            check_cost(source, prepared, costs[0])

        def told(phase: str, share: float) -> None:
            words = f", {costs[0].words()}" if costs and phase != "storing" else ""
            progress(phase + words, share)

        parts = load_or_make_parts(
            held.tets, held.fixed, source.material, told, accept, late=late, moduli=moduli
        )
    name = source.path.stem[:40]
    solid = Solid(held.tets, held.fixed, source.material, name=name, parts=parts)
    named = None if prepared.parts is None else prepared.parts.of_elements(held.parent)
    return Built(solid, prepared, named, *costs)


def held_finely(source: ObjectFile, prepared: Prepared) -> Cut:
    """Tetrahedra of a linear solid: finer where it is thin, and cut where its held region ends.

    A volume mesh is taken as it is. A nonlinear solid, whose mesh a tick has to afford, is not made
    finer either.

    Raises:
        BodyError: Too little of it is held.
        SettingError: The rule that says what is held does not fit it.
    """
    if prepared.surface is None:
        return hold(source, prepared.tets)
    diagonal = float(np.linalg.norm(np.ptp(prepared.tets.vertices, axis=0)))
    # Elements of a layer go with the square of the edge. At shorter edges a part is resolved, and
    # so many more would take memory in which the edge that was asked for fits.
    finer = _DEFAULT_EDGE / source.edge
    most = round(_MOST_FINE * min(finer, finer**2))
    cut = finer_where_thin(prepared.tets, source.edge * diagonal, most)
    held = hold(source, cut.tets)
    return replace(held, parent=cut.parent[held.parent])


def moduli_of(source: ObjectFile, prepared: Prepared, held: Cut) -> Moduli:
    """The material of each piece of a tetrahedron: that of the part that it was cut from.

    Raises:
        SettingError: A part that is not there is named, or one that is there has no material.
        BodyError: The stiffest part is too stiff for the softest one.
    """
    return source.parts.moduli(source.material, prepared.parts, held.parent)


def expected_cost(source: ObjectFile, prepared: Prepared) -> Cost:
    """What it takes to make a solid of some tetrahedra.

    Raises:
        BodyError: Too little of it is held.
        SettingError: The rule that says what is held does not fit it.
    """
    held = held_finely(source, prepared)
    plan = plan_of_solid(shape_of(held.tets, held.fixed, source.material))
    return cost_of(plan, multiplications(SystemClock()))


def check_cost(source: ObjectFile, prepared: Prepared, cost: Cost) -> None:
    """Check that an object can be factored within its memory.

    Raises:
        TooCostlyError: It takes more.
    """
    edge = None if prepared.surface is None else source.edge
    order = source.material.order
    what = f"{source.path}: {len(prepared.tets.tets):,} tetrahedra of order {order}"
    check_memory(cost, source.max_memory, what, edge, order)


def build_solid(
    source: ObjectFile,
    progress: Progress = lambda phase, share: None,
    *,
    late: bool = False,
) -> Solid:
    """The solid of `build`."""
    return build(source, progress, late=late).solid
