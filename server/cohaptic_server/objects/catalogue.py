"""Bodies by name, and from files: the one place that builds them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from cohaptic.errors import SettingError
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.spring import Spring, SpringSettings
from cohaptic_server.bodies.viscous import Viscous
from cohaptic_server.objects.build import build_solid
from cohaptic_server.objects.build_rubber import build_rubber_solid
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.progress import Progress

BODIES: dict[str, Callable[[], Body]] = {"balloon": Balloon, "spring": Spring}


# With options: by name and whether it is nonlinear, from B_o over K_o.
_DAMPED: dict[tuple[str, bool], Callable[[float], Body]] = {
    ("balloon", False): lambda damping: Balloon(damping=damping),
    ("balloon", True): lambda damping: RubberBalloon(damping=damping),
    ("spring", False): lambda damping: Spring(SpringSettings(b_o=damping * SpringSettings().k_o)),
}


def build_body(
    name: str,
    solid: ObjectFile | None = None,
    *,
    nonlinear: bool = False,
    damping: float = 0.0,
    period: float = 1.0 / 60.0,
    progress: Progress = lambda phase, share: None,
) -> Body:
    """Build the body called `name`, or the solid in the file of that name.

    Args:
        name: In the catalogue, or a path; what has a suffix or a folder in it is a path.
        solid: How a file becomes a solid; its own path does not count.
        nonlinear: Finite deformation.
        damping: B_o over K_o of eq. (9): relaxation time over simulation period.
        period: Of the simulation, within which a nonlinear solid has to find its way [s].
        progress: Is told the phase of preparing a file, and the share of it that is done.

    Raises:
        SettingError: There is no such name, or an option does not fit; says which do.
        BodyError: The file is no object that can be touched.
    """
    path = Path(name)
    named = not path.suffix and "/" not in name and "\\" not in name
    if named and name not in BODIES:
        raise SettingError("body", repr(name), f"one of: {', '.join(sorted(BODIES))}, or a file")
    if named and (nonlinear or damping != 0.0):
        if (name, nonlinear) not in _DAMPED:
            option, having = ("--nonlinear", True) if nonlinear else ("--relaxation", False)
            names = sorted(n for n, kind in _DAMPED if kind == having)
            known = f"one of: {', '.join(names)}, or a file"
            raise SettingError(f"body with {option}", repr(name), known)
        return _DAMPED[name, nonlinear](damping)
    if named:
        if solid is not None and solid != ObjectFile(solid.path):
            raise SettingError("body", repr(name), "a file, for options that describe a file")
        return BODIES[name]()
    wanted = replace(solid or ObjectFile(path), path=path)
    if nonlinear:
        return build_rubber_solid(wanted, period=period, damping=damping, progress=progress)
    elastic = build_solid(wanted, progress)
    return Viscous(elastic, damping) if damping else elastic
