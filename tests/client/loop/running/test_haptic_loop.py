"""The loop in the tests' own process, on a scripted device. Real time, but little."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cohaptic.vec import ZERO, norm
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.loop.running import haptic_loop
from cohaptic_client.loop.running.haptic_loop import status_json
from cohaptic_client.loop.safety import FAULT_RELEASE_TIME, SAFETY_FADE_RATE
from tests.client.loop.running.rigs import CLOCK, FORCE, LIMITS, OUTSIDE, Parent, Rig
from tests.client.plane import PLANE

pytestmark = pytest.mark.alone


def test_each_period_reads_then_writes_and_leaves_one_row(parent: Parent) -> None:
    rig = Rig(parent.stop_after(150))
    loop, rows = parent.run(rig)
    assert len(rows) == rig.reads == loop.statistics.periods
    assert ["read" if entry == "read" else "write" for entry in rig.log] == [
        "read",
        "write",
    ] * rig.reads
    assert [(row.fx, row.fy, row.fz) for row in rows] == rig.forces
    # Read in one period, and used in the next.
    assert [row.tick for row in rows] == [0] + [PLANE.tick] * (len(rows) - 1)
    assert all(a.t < b.t for a, b in pairwise(rows))
    assert all(row.late >= 0.0 for row in rows)


def test_told_to_stop_it_fades_to_zero_force_and_ends(parent: Parent) -> None:
    rig = Rig(parent.stop_after(150))
    loop, rows = parent.run(rig)
    assert not loop.orphaned
    sizes = [norm(force) for force in rig.forces]
    assert max(sizes) == pytest.approx(FORCE)
    assert rig.forces[-1] == ZERO
    fade = sizes[150:]  # the last that may be full, up to the next look at commands
    assert fade == sorted(fade, reverse=True)
    # A late period counts as two.
    steepest = SAFETY_FADE_RATE * 2.0 * parent.config.haptic_period
    assert all(a - b <= steepest + 1e-9 for a, b in pairwise(fade))
    # A fade, a look at commands, and the leave of a busy machine.
    fade_time = max(LIMITS.fade_time, FORCE / SAFETY_FADE_RATE)
    assert rows[-1].t - rows[149].t < fade_time + 0.05 + 0.2


def test_told_to_stop_while_nothing_is_pressed_it_ends_at_once(parent: Parent) -> None:
    """A fade as slow as a large force needs is not waited for."""
    _, rows = parent.run(Rig(parent.stop_after(100), pressed=OUTSIDE))
    assert rows[-1].t - rows[99].t < 0.05 + 0.2
    assert {(row.fx, row.fy, row.fz) for row in rows} == {ZERO}


def test_patches_that_come_after_the_word_to_stop_change_nothing(parent: Parent) -> None:
    def each(reads: int) -> None:
        if reads >= 100:
            parent.command(stop=True)
            parent.give_patch(reads)

    rig = Rig(each)
    _, rows = parent.run(rig)
    assert rig.forces[-1] == ZERO
    assert rows[-1].tick == rows[-10].tick


def test_without_a_heartbeat_it_fades_and_ends_by_itself(
    parent: Parent, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(haptic_loop, "ORPHANED_AFTER", 0.15)
    rig = Rig(lambda reads: parent.command(stop=False) if reads < 100 else None)
    loop, rows = parent.run(rig)
    assert loop.orphaned
    assert rows[-1].t - rows[0].t > 0.15
    assert max(norm(force) for force in rig.forces) > 0.0
    assert rig.forces[-1] == ZERO


def test_a_period_that_takes_too_long_is_counted_and_the_phase_is_kept(
    parent: Parent, monkeypatch: pytest.MonkeyPatch
) -> None:
    stop = parent.stop_after(60)

    def each(reads: int) -> None:
        stop(reads)
        if reads == 30:
            CLOCK.sleep_until(CLOCK.now() + 0.005)

    monkeypatch.setattr(haptic_loop, "WARM_UP", 0.0)
    loop, rows = parent.run(Rig(each))
    assert loop.statistics.missed >= 4
    period = parent.config.haptic_period
    for row in rows:
        cycles = (row.t - row.late - rows[0].t + rows[0].late) / period
        # Time in days resolves some picoseconds; a thousandth of a period is far above.
        assert cycles == pytest.approx(round(cycles), abs=1e-3)


def test_a_fault_is_in_the_report(parent: Parent) -> None:
    parent.config = replace(parent.config, limits=replace(LIMITS, stall=0.1))
    stop = parent.stop_after(200)

    def each(reads: int) -> None:
        stop(reads)
        if reads == 100:
            CLOCK.sleep_until(CLOCK.now() + 0.15)

    rig = Rig(each)
    parent.run(rig)
    # It is let go, without a jerk, in so many periods; the remainder is rounding.
    sizes = [norm(force) for force in rig.forces[99:]]
    assert sizes == sorted(sizes, reverse=True)
    steepest = 1.5 * sizes[0] / FAULT_RELEASE_TIME * 2.0 * parent.config.haptic_period
    assert all(a - b <= steepest + 1e-9 for a, b in pairwise(sizes))
    released = math.ceil(FAULT_RELEASE_TIME / parent.config.haptic_period) + 2
    assert set(rig.forces[99 + released :]) == {ZERO}  # the tip is inside: none until it was out
    status = parent.status()
    assert "the loop stood still for" in str(status["fault"])
    assert (status["faults"], status["last_fault"]) == (1, status["fault"])


def test_force_waits_for_the_switch_of_the_device_that_was_opened(parent: Parent) -> None:
    """The configuration asks for it before anybody knows whether the board has one."""
    parent.config = replace(parent.config, limits=replace(LIMITS, dead_man=True))
    without = Rig(parent.stop_after(100))
    parent.run(without)
    assert max(norm(force) for force in without.forces) > 0.0
    rig = Rig(lambda reads: parent.command(stop=reads >= 100))
    rig.info = replace(Rig.info, switch=True)  # and nobody holds it
    parent.command(stop=False)
    parent.run(rig)
    assert set(rig.forces) == {ZERO}


def test_a_fault_of_the_loop_before_keeps_the_force_off(parent: Parent) -> None:
    limits = replace(LIMITS, latch=True)
    parent.config = replace(parent.config, limits=limits, fault="the loop stood still")
    rig = Rig(parent.stop_after(100))
    _, rows = parent.run(rig)
    assert set(rig.forces) == {ZERO}
    assert {row.fault for row in rows} == {2.0}
    status = parent.status()
    assert (status["mode"], status["fault"]) == ("fault", "the loop stood still")


@given(st.text(max_size=400), st.text(max_size=20))
@example("\U0001f635" * 400, "\x00" * 20)  # the most bytes
def test_any_report_fits_its_slot(error: str, other: str) -> None:
    memory = LoopMemory.create()
    reader = LoopMemory(memory.path)
    memory.status.write(status_json(error=error, other=other))
    seen = json.loads(reader.status.read() or b"{}")
    assert seen["other"] == other
    assert error.startswith(seen["error"])
    assert len(seen["error"]) == min(len(error), 300)
    reader.close(remove=False)
    memory.close(remove=True)
