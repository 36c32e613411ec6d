"""Patches come into use a part of the work in each period, whole, in order, and none too late.

Patches that come together are all used; only a loop that falls far behind leaves some out.
"""

from __future__ import annotations

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from cohaptic.protocol.neighbourhood import Neighbourhood
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.loop.running.haptic_loop import Intake
from cohaptic_client.loop.state import flat_surface
from tests.client.plane import PLANE

NEAR = Neighbourhood.of((0, 1), ((0.0, 0.0, 0.0),) * 2, (0.004, 0.004))
LATEST = 2  # periods from seeing a patch to its use
WAITING = 8  # patches that wait at most
# Periods in which a patch comes, and whether it is one of a mesh.
comings = st.dictionaries(st.integers(0, 59), st.booleans(), max_size=60)


def frame(tick: int, *, mesh: bool) -> bytes:
    if not mesh:
        return replace(PLANE, tick=tick).encode()
    return replace(PLANE, tick=tick, geometry=Geometry.MESH, neighbourhood=NEAR).encode()


def used(patches: dict[int, bool]) -> dict[int, Patch]:
    """The patch that is used in each period that uses one; those that come have their tick."""
    memory = LoopMemory.create()
    intake = Intake(LoopMemory(memory.path).patch, flat_surface)
    found = dict[int, Patch]()
    for period in range(60 + (WAITING + 1) * (LATEST + 1)):
        if period in patches:
            memory.patch.write(frame(period + 1, mesh=patches[period]))
        if intake.advance():
            assert intake.patch is not None
            assert intake.surface == flat_surface(intake.patch)
            found[period] = intake.patch
    memory.close(remove=True)
    return found


@given(comings)
def test_each_patch_in_use_is_whole_newer_than_the_last_and_not_late(
    patches: dict[int, bool],
) -> None:
    ticks = list[int]()
    for period, patch in used(patches).items():
        came = patch.tick - 1
        assert patch == Patch.decode(frame(patch.tick, mesh=patches[came]))
        # Of what had come when it was seen it is among the newest.
        seen = period - (2 if patches[came] else 1)
        assert came in sorted(k for k in patches if k <= seen)[-WAITING:]
        ticks.append(patch.tick)
    assert ticks == sorted(set(ticks))
    assert not patches or ticks[-1] == max(patches) + 1


@given(st.sets(st.integers(0, 59), max_size=WAITING), st.booleans())
def test_patches_that_come_together_are_all_used(comes: set[int], mesh: bool) -> None:
    patches = dict.fromkeys(comes, mesh)
    assert [patch.tick - 1 for patch in used(patches).values()] == sorted(comes)


@given(comings)
def test_patches_that_leave_time_are_used_one_or_two_periods_later(
    patches: dict[int, bool],
) -> None:
    apart = {k: mesh for k, mesh in patches.items() if k % (LATEST + 1) == 0}
    expected = {k + (2 if mesh else 1): k + 1 for k, mesh in apart.items()}
    assert {period: patch.tick for period, patch in used(apart).items()} == expected


def test_patches_in_every_period_starve_none_that_is_begun() -> None:
    planes, meshes = (used(dict.fromkeys(range(60), mesh)) for mesh in (False, True))
    assert list(planes)[:20] == list(range(1, 41, 2))
    assert list(meshes)[:20] == list(range(2, 62, 3))
