"""Builds a body from its name or from a file.

A body's module is imported when the body is built, so that a server of the balloon does not load
the modules for files.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import FunctionType
from typing import TYPE_CHECKING, Any

from cohaptic.compiled import describe, is_complete
from cohaptic.errors import CohapticError, SettingError
from cohaptic.extensions import ExtensionError, adder, load
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.viscous import Viscous
from cohaptic_server.progress import Progress
from cohaptic_server.touchable import BALLOON, GROUP, SPRING, is_file, names

if TYPE_CHECKING:
    from cohaptic_server.objects.cost import Demand
    from cohaptic_server.objects.object_file import ObjectFile


def _balloon(damping: float) -> Body:
    from cohaptic_server.bodies.balloon.balloon import Balloon

    return Balloon(damping=damping)


def _rubber_balloon(damping: float) -> Body:
    from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon

    return RubberBalloon(damping=damping)


def _spring(damping: float) -> Body:
    from cohaptic_server.bodies.spring import Spring, SpringSettings

    return Spring(SpringSettings(b_o=damping * SpringSettings().k_o))


_PARTS = ("name", "mesh", "contact_radius", "respond")  # members of the Protocol `Body`
# Constructors that take B_o over K_o, by name and by whether the body is nonlinear.
_NAMED: dict[tuple[str, bool], Callable[[float], Body]] = {
    (BALLOON, False): _balloon,
    (BALLOON, True): _rubber_balloon,
    (SPRING, False): _spring,
}


def build_body(
    name: str,
    options: ObjectFile | None = None,
    *,
    nonlinear: bool = False,
    damping: float = 0.0,
    hz: float = 60.0,
    demand: Demand | None = None,
    progress: Progress = lambda phase, fraction: None,
    late: bool = False,
) -> Body:
    """Build the body called `name`, or the solid in the file of that name.

    Args:
        name: A name in the catalogue, or a path; a text with a suffix or a folder is a path.
        options: Options of an object from a file; their own path is replaced by `name`.
        nonlinear: Whether to build the nonlinear body, for large deformation.
        damping: B_o over K_o of eq. (9): relaxation time over simulation period.
        hz: Ticks per second, for the integration of an object with mass.
        demand: Number of users and tick rate, for which the mesh of a nonlinear solid is chosen.
        progress: Called with the phase of preparing a file, and the share of it that is done.
        late: Whether a stored factor is read when it is first needed, and not now.

    Raises:
        SettingError: The name is not in the catalogue, or an option does not fit the body.
        BodyError: The file does not hold an object that can be touched.
        ExtensionError: The package that adds the body is broken.
    """
    if nonlinear and not is_complete("kernels"):
        # Without compiled modules the loops over elements would take a second in each tick.
        limit = f"linear here: a nonlinear one needs compiled modules ({describe('kernels')})"
        raise SettingError("body with --nonlinear", repr(name), limit)
    if is_file(name):
        return _from_file(Path(name), options, nonlinear, damping, hz, demand, progress, late)
    if name not in names():
        raise SettingError("body", repr(name), f"one of: {', '.join(names())}, or a file")
    ours = (name, False) in _NAMED
    if nonlinear and (name, True) not in _NAMED:
        finite = sorted(other for other, is_nonlinear in _NAMED if is_nonlinear)
        known = f"one of: {', '.join(finite)}, or a file"
        raise SettingError("body with --nonlinear", repr(name), known)
    plain = not nonlinear and damping == 0.0
    if plain and options is not None and options != type(options)(options.path):
        raise SettingError("body", repr(name), "a file, for options that describe a file")
    return _NAMED[name, nonlinear](damping) if ours else _added(name, damping)


def _added(name: str, damping: float) -> Body:
    """Make a body that a package adds; raises ExtensionError if the package returns none."""
    make: Any = load(GROUP, name, type, FunctionType)
    package = adder(GROUP, name)
    try:
        made = make()
    except CohapticError:
        raise
    except Exception as error:  # the code of a package: the error names the package
        raise ExtensionError(GROUP, name, package, f"{type(error).__name__}: {error}") from error
    absent = [part for part in _PARTS if not hasattr(made, part)]
    if absent:
        raise ExtensionError(GROUP, name, package, f"its body has no {absent[0]}")
    return Viscous(made, damping) if damping else made


def _from_file(
    path: Path,
    options: ObjectFile | None,
    nonlinear: bool,
    damping: float,
    hz: float,
    demand: Demand | None,
    progress: Progress,
    late: bool,
) -> Body:
    """Build the solid in a file; arguments and errors as for `build_body`."""
    from cohaptic_server.objects.build import build
    from cohaptic_server.objects.build_rubber import build_rubber_solid
    from cohaptic_server.objects.cost import Demand
    from cohaptic_server.objects.inertia.modes_of import with_inertia
    from cohaptic_server.objects.object_file import ObjectFile

    source = replace(options or ObjectFile(path), path=path)
    if source.inertia.given and (nonlinear or damping):
        other = "--nonlinear" if nonlinear else "--relaxation"
        raise SettingError("--density", f"given with {other}", f"given without {other}")
    if nonlinear:
        return build_rubber_solid(
            source, demand=demand or Demand(nonlinear=True), damping=damping, progress=progress
        )
    built = build(source, progress, late=late)
    if source.inertia.given:
        return with_inertia(built, source, hz, progress)
    return Viscous(built.solid, damping) if damping else built.solid
