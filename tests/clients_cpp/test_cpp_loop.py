"""The loop in C++ beside the one in Python, through whole sessions that nobody has chosen.

The vectors show what a hand meets; here surfaces turn, periods are late, sensors jump and links
waver at random, so that every rule and every constant of the loop comes into play.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import pytest

from cohaptic.control.law import Law
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.vec import ZERO, Vec3, add, norm, scale, unit
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.arrival import is_silent, receive
from cohaptic_client.loop.config import silent_after
from cohaptic_client.loop.safety import Mode, SafetyLimits
from cohaptic_client.loop.slew import turn_back
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.step import step
from tests.clients_cpp.programs import Questions

pytestmark = pytest.mark.live

TICK = 0.016  # s
FOLLOW = 100.0  # 1/s; a tip follows what its hand wants, and with a jump of that is too fast
CLOSE, ROUND = 1e-6, 1e-9  # as in test_cpp_client.py


class Moment(NamedTuple):
    """One period: its time [s], patches that have come, and what the device says."""

    now: float
    patches: list[Patch]
    tip: Vec3
    velocity: Vec3


@dataclass(frozen=True, slots=True)
class Session:
    """How rough a session is.

    Args:
        seconds: How long it is.
        bend: Largest change of the normal.
        late: Share of periods that are late.
        wavers: Largest lateness of a patch [s].
        jumps: Share of periods in which the sensor jumps.
        stall: A longer period is a fault [s].
        speed: Of the hand, in swings a second.
        latch: Whether a fault stays until it is acknowledged.
        hard: How much harder the surface is than a soft one, and the device stiffer.
        max_force: Of the device [N].
    """

    seconds: float = 5.0
    bend: float = 0.1
    late: float = 0.0
    wavers: float = 0.0
    jumps: float = 0.0
    stall: float = 0.02
    speed: float = 1.0
    latch: bool = False
    hard: float = 1.0
    max_force: float = 10.0

    @property
    def max_stiffness(self) -> float:
        """Of the device [N/m]."""
        return 600.0 * self.hard


SESSIONS = {
    "calm": Session(bend=0.0),
    "turning": Session(bend=0.8),
    "late periods": Session(late=0.05),
    "stalls": Session(late=0.02, stall=1.0),
    "jumps": Session(jumps=2e-4, speed=0.3),
    "a fast hand": Session(speed=6.0, bend=0.3),
    "a fast hand at a hard place": Session(speed=10.0, hard=8.0, wavers=0.03, max_force=40.0),
    "latching": Session(jumps=2e-4, speed=0.3, latch=True),
    "a link that wavers": Session(seconds=9.0, wavers=0.06),
}


def moments(session: Session, seed: int) -> Iterator[Moment]:
    """The periods of a session, the same for a seed in both languages."""
    rng = random.Random(seed)
    now, tick, next_tick, due = 0.0, 0, 0.0, list[tuple[float, Patch]]()
    curvature = rng.choice([0.0, 8.0, -5.0])
    softest = rng.choice([1.0, 1.0 - 5e-4, 0.7])  # of the gain, against 1 / c_ii
    tip, phase = (0.0, 0.0, 0.02), rng.uniform(0.0, 6.0)
    while now < session.seconds:
        dt = 0.001
        if rng.random() < session.late:
            dt = rng.choice([0.0, 0.0004, 0.0017, 0.004, 0.012, 0.03])
        now = round(now + dt, 6)
        while next_tick <= now:
            tick += 1
            if not 3.0 < next_tick % 5.0 < 3.2:  # a silence now and then
                late = rng.uniform(0.005, 0.02) + rng.uniform(0.0, session.wavers)
                due.append(
                    (
                        max([next_tick + late, *(at for at, _ in due)]),
                        a_patch(rng, session, tick, next_tick, curvature, softest),
                    )
                )
            next_tick += TICK
        came = [patch for at, patch in due if at <= now]
        due = [(at, patch) for at, patch in due if at > now]
        angle = 2.0 * math.pi * session.speed * now + phase
        wanted = (0.004 * math.sin(0.7 * angle), 0.003 * math.cos(angle), 0.012 * math.cos(angle))
        if now < 1.0:  # a hand is engaged outside only
            wanted = (wanted[0], wanted[1], 0.015)
        if rng.random() < session.jumps:
            wanted = add(wanted, (0.0, 0.02, 0.0))
        before, tip = tip, add(tip, scale(add(wanted, scale(tip, -1.0)), min(1.0, FOLLOW * dt)))
        velocity = scale(add(tip, scale(before, -1.0)), 1.0 / max(dt, 1e-4))
        if rng.random() < session.jumps:
            tip = add(tip, (0.0, 0.03, 0.0))
        elif rng.random() < 10.0 * session.jumps:  # of a device that reports seldom: no fault
            tip = add(tip, (0.0, 0.0025, 0.0))
        yield Moment(now, came, tip, velocity)


def a_patch(
    rng: random.Random, session: Session, tick: int, t: float, curvature: float, softest: float
) -> Patch:
    """The surface at a tick, which others move and turn."""
    bend = session.bend
    normal = unit((bend * math.sin(3.0 * t), bend * math.cos(2.0 * t) * rng.uniform(0.5, 1.0), 1.0))
    c_ii = rng.uniform(0.0035, 0.0045) / session.hard
    return Patch(
        tick=tick, seq=0, t_server=t, t_client=0.0, sample_wait=0.0,
        geometry=Geometry.SPHERE if curvature else Geometry.PLANE, law=Law.PREDICTIVE,
        x_free=(0.0, 0.0, 0.003 * math.sin(11.0 * t) + rng.uniform(-1e-3, 1e-3)),
        normal=normal, curvature=curvature, c_ii=c_ii,
        k_h=min(session.max_stiffness, softest / c_ii),
        integral_gain=0.0, own_force=scale(normal, 1.0 + math.sin(7.0 * t)), u_others=ZERO,
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", SESSIONS)
def test_both_loops_give_the_same_force_in_every_period(
    vectors: Questions, name: str, seed: int
) -> None:
    session = SESSIONS[name]
    limits = SafetyLimits(
        silent_after=silent_after(TICK),
        engage_time=0.2,
        stall=session.stall,
        latch=session.latch,
        max_force=session.max_force,
    )
    stiffness = session.max_stiffness
    settings = LoopSettings(TICK, limits, max_damping=5.0, max_stiffness=stiffness)
    vectors.ask(
        "loop", TICK, stiffness, 5.0, 0.2, session.stall, session.latch, 1000.0, session.max_force
    )
    state, felt, periods, faults = LoopState(), 0.0, 0, 0
    for moment in moments(session, seed):
        now = moment.now
        for patch in moment.patches:
            state = receive(state, patch, now, settings)
            vectors.ask(
                "give", now, patch.x_free, patch.normal, patch.curvature, patch.c_ii,
                patch.own_force, patch.u_others, patch.tick, patch.t_server, patch.k_h,
            )  # fmt: skip
        sample = DeviceSample(moment.tip, moment.velocity)
        state, period = step(state, sample, now, settings)
        got = vectors.numbers("step", moment.tip, moment.velocity, now)
        safety = state.safety
        expected = [
            *period.force, *period.on_body, state.depth, state.k_h, state.patience,
            state.playout.behind, state.passivity.owed, state.passivity.stored, safety.scale,
            safety.left, float(safety.mode is Mode.ENGAGED),
            float(is_silent(state, now, settings)),
        ]  # fmt: skip
        # Without pytest.approx, which would take most of the time of so many periods.
        assert len(got) == len(expected)
        for a, b in zip(got, expected, strict=True):
            assert a == b or abs(a - b) <= ROUND + CLOSE * abs(b), (now, got, expected)
        felt, periods = max(felt, norm(period.force)), periods + 1
        faults += safety.mode is Mode.FAULT
        if safety.mode is Mode.FAULT and periods % 500 == 0:
            state = state.acknowledged()
            vectors.ask("acknowledge")
    assert periods > 1000
    assert felt > 0.3
    assert session.latch or faults == 0


def test_normals_turn_as_in_python_also_to_the_opposite(vectors: Questions) -> None:
    rng = random.Random(3)
    for _ in range(200):
        normal = unit((rng.gauss(0.0, 1.0), rng.gauss(0.0, 1.0), rng.gauss(0.0, 1.0)))
        other = unit((rng.gauss(0.0, 1.0), rng.gauss(0.0, 1.0), rng.gauss(0.0, 1.0)))
        for target in (normal, other, scale(normal, -1.0)):
            limit = rng.choice([0.0, 0.01, 0.5, 4.0])
            turned, angle = turn_back(normal, target, limit)
            got = vectors.numbers("turn", normal, target, limit)
            assert got == pytest.approx([*turned, angle], rel=CLOSE, abs=ROUND)


def test_a_hand_that_lets_go_fades_and_takes_no_patch_any_more(vectors: Questions) -> None:
    """10 N/s at most, and in 0.15 s at least, whatever the server goes on to send."""
    surface = replace(a_patch(random.Random(0), Session(bend=0.0), 1, 0.0, 0.0, 1.0), x_free=ZERO)
    vectors.ask("loop", TICK, 600.0, 0.0, 0.2, 0.02, False, 1000.0, 10.0)
    force, given = 0.0, list[float]()
    for i in range(3000):
        now = round(0.001 * i, 6)
        if i % 16 == 0:
            vectors.ask(
                "give", now, surface.x_free, surface.normal, 0.0, surface.c_ii, ZERO, ZERO,
                i // 16 + 1, now, surface.k_h,
            )  # fmt: skip
        if i == 2000:
            vectors.ask("let_go")
        depth = min(0.008, max(-0.005, 0.02 * (now - 0.8)))
        before, force = force, vectors.numbers("step", (0.0, 0.0, -depth), ZERO, now)[2]
        if i >= 2000:
            assert before - force <= 0.01 + ROUND
            given.append(force)
    assert given[0] > 1.5
    assert given[100] > 0.0
    assert given[-1] == 0.0
