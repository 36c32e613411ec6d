"""The loops over all users give the same compiled and as the Python that they were made from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from cohaptic.protocol.patch import Patch
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.world import (
    applied_forces,
    contact_tracking,
    displacement_field,
    patch_geometry,
)
from cohaptic_server.world.stages import surfaces
from tests.compiled_modules import compiled_module, plain_module
from tests.server.world.rooms import TICKS, mixed_room, numbers

LOOPS = "cohaptic_server.world.loops."
# Where each loop is called: module, name there, module of the loop, name in it.
CALLS = [
    (contact_tracking, "track", "tracking", "track"),
    (contact_tracking, "heights", "vectors", "heights"),
    (contact_tracking, "pressed", "vectors", "pressed"),
    (contact_tracking, "smoothed", "vectors", "smoothed"),
    (applied_forces, "jumped", "vectors", "jumped"),
    (applied_forces, "tangential_parts", "vectors", "tangential_parts"),
    (patch_geometry, "choose_in_one_call", "windows", "choose_windows"),
    (patch_geometry, "tangential_parts", "vectors", "tangential_parts"),
    (surfaces, "put_contacts", "free_surfaces", "put_contacts"),
    (surfaces, "heights", "vectors", "heights"),
    (displacement_field, "flatten", "free_surfaces", "flatten"),
    (patch_geometry, "largest", "packing", "largest"),
    (patch_geometry, "pack", "packing", "pack"),
]


def patches(body: Balloon, how: Callable[[str], Any]) -> list[dict[int, Patch]]:
    """Patches of every tick of a room, with the loops that `how` finds by their modules."""
    with pytest.MonkeyPatch.context() as patch:
        for module, name, loop, function in CALLS:
            patch.setattr(module, name, getattr(how(LOOPS + loop), function))
        return [found for _, found in mixed_room(body, TICKS)]


def test_a_room_is_the_same_compiled_and_plain(small_balloon: Balloon) -> None:
    compiled, plain = (patches(small_balloon, how) for how in (compiled_module, plain_module))
    for one, other in zip(compiled, plain, strict=True):
        assert one.keys() == other.keys()
        for user, found in one.items():
            assert numbers(found) == pytest.approx(numbers(other[user]), rel=1e-9, abs=1e-12)
            assert found.neighbourhood == other[user].neighbourhood
