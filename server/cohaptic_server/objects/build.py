"""A file, a material and a rule become a solid body."""

from __future__ import annotations

from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.objects.fix_rule import check_said, held_in
from cohaptic_server.objects.object_file import ObjectFile, Prepared
from cohaptic_server.objects.store.store import parts_of, prepared
from cohaptic_server.progress import Progress


@dataclass(frozen=True, eq=False)
class Built:
    """A solid, and what came of its file on the way.

    Args:
        solid: The body.
        prepared: Tetrahedra, and what was found of the surface.
    """

    solid: Solid
    prepared: Prepared


def build(wanted: ObjectFile, progress: Progress = lambda phase, share: None) -> Built:
    """The solid body of a file; what takes long comes from the store, or goes there.

    Args:
        wanted: The file and its options.
        progress: Is told the phase and the share of it that is done.

    Raises:
        BodyError: The file is no object that can be touched.
        SettingError: An option does not fit it.
    """
    check_said(wanted)
    progress("tetrahedra", 0.0)
    made = prepared(wanted)
    held = held_in(wanted, made.tets.vertices)
    # Beside other work on the same cores two BLAS threads wait for each other: 32 solves of an
    # organ of 9,000 quadratic tetrahedra took 8.5 s instead of 0.2 s (docs/decisions/0006).
    with threadpool_limits(limits=1):
        parts = parts_of(made.tets, held, wanted.material, progress)
    name = wanted.path.stem[:40]
    return Built(Solid(made.tets, held, wanted.material, name=name, parts=parts), made)


def build_solid(wanted: ObjectFile, progress: Progress = lambda phase, share: None) -> Solid:
    """The solid of `build`."""
    return build(wanted, progress).solid
