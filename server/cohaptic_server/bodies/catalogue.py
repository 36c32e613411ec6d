"""Bodies by name."""

from __future__ import annotations

from collections.abc import Callable

from cohaptic.errors import SettingError
from cohaptic_server.bodies.balloon import Balloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.spring import Spring

BODIES: dict[str, Callable[[], Body]] = {"balloon": Balloon, "spring": Spring}


def build_body(name: str) -> Body:
    """Build the body called `name`; raises SettingError with the names that exist."""
    if name not in BODIES:
        raise SettingError("body", repr(name), f"one of: {', '.join(sorted(BODIES))}")
    return BODIES[name]()
