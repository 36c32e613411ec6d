"""A hostile server and a bad link, through session, memory and the intake's parts, to the force.

Whatever comes, and whenever: the loop runs on, the force steps nowhere, no patch is in use that is
not whole, and without patches the force fades.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cohaptic.control.playout import LONGEST
from cohaptic.control.room_lag import RoomLag
from cohaptic.control.tick_ledger import TickLedger
from cohaptic.protocol.neighbourhood import Neighbourhood
from cohaptic.protocol.patch import Patch
from cohaptic.simulated.delay_line import DelayLine, LinkSettings
from cohaptic.vec import ZERO, norm, sub
from cohaptic_client.loop.memory import LoopMemory, Slot
from cohaptic_client.loop.safety import EXTERNAL_RATE
from tests.client.plane import PLANE, STIFFNESS
from tests.examples_of_laws import examples
from tests.system.virtual_touch import (
    AT_REST,
    DEPTH,
    NEAR,
    PERIOD,
    TICK,
    Seen,
    Touch,
    good,
)

END = 1000  # periods; at the end the force of a silent server has faded
STEP = 1.02 * EXTERNAL_RATE * PERIOD  # N; the second order of a turn with it
# Frames of 88 bytes and more: where they are cut, and where a number becomes none.
places = st.integers(0, 10_000)
NOT_NUMBERS = (math.nan, math.inf, -math.inf)
plays = settings(
    max_examples=examples(15),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


def friendly(until: int = END, *, mesh: bool) -> dict[int, list[bytes]]:
    """A patch every tick."""
    return {n: [good(1 + n // TICK, mesh=mesh).encode()] for n in range(0, until, TICK)}


def check(seen: Seen, periods: int = END) -> None:
    """What holds of every touch."""
    assert len(seen.forces) == periods
    assert all(norm(force) <= 10.0 for force in seen.forces)  # no NaN either
    # The hand rests, so all that its force does is the server's.
    for before, after in pairwise(seen.forces[AT_REST:]):
        assert norm(sub(after, before)) <= STEP
    assert {0, *seen.accepted} >= set(seen.ticks)


def not_a_number(value: float) -> Callable[[bytes, int], bytes]:
    """A frame with a float that is none."""

    def broken(frame: bytes, place: int) -> bytes:
        # From the normal to the others' displacement: 32-bit floats.
        at = 4 + 32 + 4 * (place % 17)
        return frame[:at] + struct.pack("<f", value) + frame[at + 4 :]

    return broken


def cut(frame: bytes, place: int) -> bytes:
    return frame[: place % len(frame)]


def too_long(frame: bytes, place: int) -> bytes:
    return frame + bytes(1 + place % 200)


def wrong_vertex(frame: bytes, place: int) -> bytes:
    """The last vertex of a mesh patch is none of the resting mesh; another kind for a plane."""
    if frame[2] & 0x0F != 3:
        return frame[:2] + b"\xff" + frame[3:]
    return frame[:-10] + struct.pack("<H", 81 + place) + frame[-8:]


@pytest.mark.parametrize("spoil", [*map(not_a_number, NOT_NUMBERS), cut, too_long, wrong_vertex])
@given(
    mesh=st.booleans(),
    place=places,
    when=st.integers(AT_REST, AT_REST + 3 * TICK),
    after=st.integers(0, 4),
)
@plays
def test_a_broken_patch_at_any_time_ends_the_session_and_the_force_fades(
    tmp_path: Path,
    spoil: Callable[[bytes, int], bytes],
    mesh: bool,
    place: int,
    when: int,
    after: int,
) -> None:
    """Also `after` periods behind a good one, which is then half taken."""
    messages = friendly(when, mesh=mesh)
    messages.setdefault(when, []).append(good(900, mesh=mesh).encode())
    broken = spoil(good(901, mesh=mesh).encode(), place)
    messages.setdefault(when + after, []).append(broken)
    messages.setdefault(when + after + 1, []).append(good(902, mesh=mesh).encode())
    seen = Touch(tmp_path, messages, END).run()
    check(seen)
    assert seen.refused
    # The good one before it is in use to the end, the broken one and those behind it never.
    assert seen.accepted[-1] == seen.ticks[-1] == 900
    assert seen.forces[AT_REST][2] == pytest.approx(STIFFNESS * DEPTH, rel=0.01)
    assert seen.forces[-1] == ZERO


wild = st.builds(
    replace,
    st.builds(good, st.integers(1, 2**32 - 1), mesh=st.booleans()),
    x_free=st.sampled_from([ZERO, (0.0, 0.0, 9.9), (0.0, 0.0, -9.9), (5.0, -5.0, 0.02)]),
    normal=st.sampled_from([PLANE.normal, (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, -0.6, 0.8)]),
    curvature=st.sampled_from([0.0, -1e4, 1e4]),
    c_ii=st.sampled_from([PLANE.c_ii, 1e-6, 10.0]),
    k_h=st.sampled_from([STIFFNESS, 0.0, 1e6]),
    integral_gain=st.sampled_from([0.0, 1e9]),
    own_force=st.sampled_from([ZERO, (0.0, 0.0, 99.0), (0.0, -99.0, 0.0)]),
    u_others=st.sampled_from([ZERO, (0.0, 0.0, 9.0), (0.0, 0.0, -9.0)]),
)


@given(st.dictionaries(st.integers(AT_REST, AT_REST + 200), st.lists(wild, max_size=3)))
@plays
def test_patches_at_their_limits_at_any_time_step_no_force(
    tmp_path: Path, attacks: dict[int, list[Patch]]
) -> None:
    messages = friendly(AT_REST, mesh=True)
    for n, patches in attacks.items():
        messages.setdefault(n, []).extend(patch.encode() for patch in patches)
    periods = 2000  # 10 N are faded in a second
    seen = Touch(tmp_path, messages, periods).run()
    check(seen, periods)
    assert seen.refused == ""
    assert seen.forces[-1] == ZERO


@pytest.mark.parametrize("mesh", [False, True])
@given(seed=st.integers(0, 2**32 - 1))
@plays
def test_with_400_ms_of_jitter_patches_are_in_use_in_time_and_no_force_steps(
    tmp_path: Path, mesh: bool, seed: int
) -> None:
    """They come in bunches and none for up to 400 ms."""
    periods = 2000
    line = DelayLine[bytes](LinkSettings(0.0, 0.4, seed))
    messages = friendly(AT_REST, mesh=mesh)
    came = dict[int, int]()
    last = AT_REST // TICK
    for n in range(AT_REST, periods):
        now = n * PERIOD
        if n % TICK == 0:
            last += 1
            line.push(good(last, mesh=mesh).encode(), now)
        for frame in line.pop_due(now):
            messages.setdefault(n, []).append(frame)
            came[n] = Patch.decode(frame).tick
    seen = Touch(tmp_path, messages, periods).run()
    check(seen, periods)
    assert seen.refused == ""
    assert seen.ticks == sorted(seen.ticks)
    # Behind the least delay by as much as is waited for, after a pause by as much again.
    latest = round((2.0 * LONGEST + 3.0 * TICK * PERIOD) / PERIOD)
    for n, tick in came.items():
        assert n + latest >= periods or seen.ticks[n + latest] >= tick


@given(
    st.booleans(),
    st.lists(st.tuples(st.integers(0, 100), st.integers(1, 950)), max_size=20),
)
@plays
def test_a_patch_that_is_half_written_is_not_used(
    tmp_path: Path, mesh: bool, torn: list[tuple[int, int]]
) -> None:
    """The network's process may be stopped in the middle of a write, for any time, or killed."""
    # Unlike the others to its last byte: else less than all of it would be the whole.
    ledger = TickLedger(gain_cut=257.0)
    patch = replace(good(999, mesh=mesh), room=RoomLag(0.35, 1.25, 1.5), ledger=ledger)
    if mesh:
        count = len(NEAR.indices)
        compliances = (*(PLANE.c_ii,) * (count - 1), 0.5 * PLANE.c_ii)
        near = Neighbourhood.of(NEAR.indices, (ZERO,) * count, compliances)
        patch = replace(patch, neighbourhood=near)
    other = LoopMemory.create()
    try:
        for _ in range(100):  # a version of its own
            other.patch.write(patch.encode())
        with open(other.path, "rb") as file:
            image = file.read(Slot.size(len(patch.encode())))
    finally:
        other.close(remove=True)

    def meddle(n: int, memory: LoopMemory) -> None:
        for at, length in torn:
            if n == AT_REST + at:
                with open(memory.path, "r+b") as file:
                    file.write(image[: min(length, len(image) - 1)])

    seen = Touch(tmp_path, friendly(mesh=mesh), END, meddle).run()
    check(seen)
    assert 999 not in seen.ticks
    assert seen.ticks[-1] >= max(seen.accepted) - 1
