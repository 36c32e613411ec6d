"""Bodies by name."""

from __future__ import annotations

from collections.abc import Callable

from cohaptic.errors import SettingError
from cohaptic_server.bodies.balloon import Balloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.rubber_balloon import RubberBalloon
from cohaptic_server.bodies.spring import Spring, SpringSettings

BODIES: dict[str, Callable[[], Body]] = {"balloon": Balloon, "spring": Spring}


# With options: by name and whether it is nonlinear, from B_o over K_o.
_DAMPED: dict[tuple[str, bool], Callable[[float], Body]] = {
    ("balloon", False): lambda damping: Balloon(damping=damping),
    ("balloon", True): lambda damping: RubberBalloon(damping=damping),
    ("spring", False): lambda damping: Spring(SpringSettings(b_o=damping * SpringSettings().k_o)),
}


def build_body(name: str, *, nonlinear: bool = False, damping: float = 0.0) -> Body:
    """Build the body called `name`.

    Args:
        name: One of `BODIES`.
        nonlinear: Finite deformation.
        damping: B_o over K_o of eq. (9): relaxation time over simulation period.

    Raises:
        SettingError: There is no such body; the message says which there are.
    """
    if name not in BODIES:
        raise SettingError("body", repr(name), f"one of: {', '.join(sorted(BODIES))}")
    if not nonlinear and damping == 0.0:
        return BODIES[name]()
    if (name, nonlinear) not in _DAMPED:
        option, having = ("--nonlinear", True) if nonlinear else ("--relaxation", False)
        names = sorted(n for n, kind in _DAMPED if kind == having)
        raise SettingError(f"body with {option}", repr(name), f"one of: {', '.join(names)}")
    return _DAMPED[name, nonlinear](damping)
