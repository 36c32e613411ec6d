"""A file, a material and a rule become a solid body."""

from __future__ import annotations

from cohaptic.errors import SettingError
from cohaptic_server.bodies.solid import Solid
from cohaptic_server.objects.hold import held_by
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.store import prepared


def build_solid(wanted: ObjectFile) -> Solid:
    """The solid body of a file.

    Raises:
        BodyError: The file is no object that can be touched.
        SettingError: An option does not fit it.
    """
    if not wanted.fix.strip():
        raise SettingError("--fix", "not given", 'a rule, or the object floats away: "z < 10%"')
    tets = prepared(wanted).tets
    held = held_by(wanted.fix, tets.vertices)
    return Solid(tets, held, wanted.material, name=wanted.path.stem[:40])
