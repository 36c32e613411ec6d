"""Finds the options with which the object in a file can be touched; tells or sets them (--auto)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cohaptic.errors import BodyError
from cohaptic_server.cli.object_options import ObjectOptions
from cohaptic_server.objects.auto.diagnose import Diagnosis
from cohaptic_server.objects.auto.resolve import find_problems, resolve
from cohaptic_server.objects.cost import Demand
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store.store import is_prepared
from cohaptic_server.progress import Progress


def wanted(users: int | None, hz: float, *, nonlinear: bool = False) -> Demand | None:
    """Return the users and tick rate that a mesh must allow; None if any mesh will do.

    Args:
        users: Number of users who touch at once; None if the option is missing.
        hz: Ticks per second.
        nonlinear: Whether the body is nonlinear (finite deformation); its mesh is always limited.

    Raises:
        SettingError: A value is out of its range.
    """
    if users is None:
        return Demand(hz=hz, nonlinear=True) if nonlinear else None
    return Demand(users, hz, nonlinear)


def resolved(
    path: Path,
    options: ObjectOptions,
    progress: Progress,
    tell: Callable[[str], None],
    demand: Demand | None = None,
) -> ObjectFile:
    """Return the object in a file, with options with which it can be touched.

    Args:
        options: Options as the user has written them.
        progress: Called with the name of each phase and the finished fraction of it, 0 to 1.
        tell: Called with a sentence for each option that `--auto` sets, or that is advised.
        demand: Users and tick rate that the mesh has to allow; None for any mesh.

    Raises:
        BodyError: The object cannot be touched with these options; the error lists all problems.
        SettingError: An option does not fit the object.
    """
    if demand is not None:
        demand.check()
    source, scale_given = options.of(path), "scale" in options.given
    if options.auto:
        softness = "young" not in options.given
        found = resolve(source, progress, scale_given=scale_given, softness=softness, demand=demand)
        for remedy in found.remedies:
            tell(remedy.sentence())
        return found.source
    if not is_prepared(source):
        progress("looking at the file", 0.0)
        found = find_problems(source, scale_given=scale_given)
        if found.needed:
            raise BodyError(what_is_lacking(found))
        for remedy in found.remedies:
            tell(f"advice: {remedy.sentence()}")
    return source


def what_is_lacking(found: Diagnosis) -> str:
    """Return an error text with all problems that make an object unusable, and their options."""
    path, needed = found.source.path, found.needed
    if len(needed) == 1:
        one = needed[0]
        return f"{path}: {one.problem}. With {one.option}: {one.remedy}. Or let --auto choose"
    listed = "".join(f"\n  {one.problem}:\n    {one.option}  ({one.remedy})" for one in needed)
    return (
        f"{path}: {len(needed)} things keep it from being touched; an option for each:{listed}\n"
        "Take these, others of your own, or --auto for all of them"
    )
