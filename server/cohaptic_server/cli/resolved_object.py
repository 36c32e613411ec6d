"""What a file needs before it can be touched: told all at once, or done with `--auto`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cohaptic.errors import BodyError
from cohaptic_server.cli.object_options import ObjectOptions
from cohaptic_server.objects.auto.remedy import Diagnosis
from cohaptic_server.objects.auto.resolve import find_problems, resolve
from cohaptic_server.objects.demand import Demand
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store.store import is_prepared
from cohaptic_server.progress import Progress


def wanted(users: int | None, hz: float, *, nonlinear: bool = False) -> Demand | None:
    """What an object is prepared for; None where the mesh of a linear one may be any.

    Args:
        users: Who touch it at once, if that is said.
        hz: Ticks per second.
        nonlinear: Whether the deformation is finite.

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
    """The object in a file with options with which it can be touched.

    Args:
        path: The file.
        options: As they were given.
        progress: Called with the phase.
        tell: Called with a sentence for each option that `--auto` takes, or that is advised.
        demand: What it is prepared for, if that is said.

    Raises:
        BodyError: It cannot be touched with these options; all that it lacks is said.
        SettingError: An option does not fit it.
    """
    if demand is not None:
        demand.check()
    source, scale_given = options.of(path), options.scale is not None
    if options.auto:
        found = resolve(source, progress, scale_given=scale_given, demand=demand)
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
    """All that keeps an object from being touched, with an option for each, as one error."""
    path, needed = found.source.path, found.needed
    if len(needed) == 1:
        one = needed[0]
        return f"{path}: {one.problem}. With {one.option}: {one.remedy}. Or let --auto choose"
    listed = "".join(f"\n  {one.problem}:\n    {one.option}  ({one.remedy})" for one in needed)
    return (
        f"{path}: {len(needed)} things keep it from being touched; an option for each:{listed}\n"
        "Take these, others of your own, or --auto for all of them"
    )
