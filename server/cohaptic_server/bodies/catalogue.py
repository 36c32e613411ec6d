"""Bodies by name, and from files: the one place that builds them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from cohaptic.errors import SettingError
from cohaptic_server.bodies.balloon import Balloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.spring import Spring
from cohaptic_server.objects.build import build_solid
from cohaptic_server.objects.object_file import ObjectFile

BODIES: dict[str, Callable[[], Body]] = {"balloon": Balloon, "spring": Spring}


def build_body(name: str, solid: ObjectFile | None = None) -> Body:
    """Build the body called `name`, or the solid in the file of that name.

    Args:
        name: In the catalogue, or a path; what has a suffix or a folder in it is a path.
        solid: How a file becomes a solid; its own path does not count.

    Raises:
        SettingError: There is no such name, or an option does not fit; says which do.
        BodyError: The file is no object that can be touched.
    """
    if name in BODIES:
        if solid is not None and solid != ObjectFile(solid.path):
            raise SettingError("body", repr(name), "a file, for options that describe a file")
        return BODIES[name]()
    path = Path(name)
    if not path.suffix and "/" not in name and "\\" not in name:
        raise SettingError("body", repr(name), f"one of: {', '.join(sorted(BODIES))}, or a file")
    return build_solid(replace(solid or ObjectFile(path), path=path))
