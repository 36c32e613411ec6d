"""Periods, states and forces for the tests of the safety layer."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from hypothesis import strategies as st

from cohaptic.control.geometry import Sight
from cohaptic.control.law import DEFAULT_LAW
from cohaptic.control.laws.model import Gains
from cohaptic.vec import ZERO, Vec3, norm, scale
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop import period as one
from cohaptic_client.loop.chain import CHAIN
from cohaptic_client.loop.law_fade import LawFade, Running
from cohaptic_client.loop.rules.guard import SWITCH
from cohaptic_client.loop.safety import Mode, SafetyLimits, SafetyState
from cohaptic_client.loop.state import LoopSettings, LoopState
from tests.strategies import vectors

LIMITS = SafetyLimits()
PERIOD = LIMITS.period  # s
ROUNDING = 1e-9  # N; forces of some newtons in doubles
PRESSED = SafetyState(Mode.ENGAGED, 1.0, ZERO, 4, 0.0)  # engaged in full, no force yet


class Period(NamedTuple):
    """Inputs of the safety layer in one period."""

    wanted: Vec3
    velocity: Vec3 = ZERO
    silent: bool = False
    dt: float = PERIOD


any_vector = st.tuples(st.floats(), st.floats(), st.floats())
forces = vectors(40.0)  # up to 35 N: several times the limit
periods = st.lists(
    st.builds(
        Period,
        wanted=st.one_of(vectors(0.2), vectors(5.0), forces, any_vector),
        velocity=st.one_of(st.just(ZERO), vectors(2.0), any_vector),
        silent=st.booleans(),
        dt=st.one_of(st.just(PERIOD), st.floats(0.0, 0.03)),
    ),
    max_size=12,
)


pressed = st.builds(
    SafetyState,
    mode=st.just(Mode.ENGAGED),
    scale=st.floats(0.0, 1.0),
    force=vectors(5.0),
    quiet=st.just(0),
    now=st.just(0.0),
    fault=st.just(""),
    released=st.just(ZERO),
    left=st.just(0.0),
)


def smooth(left: float) -> float:
    """Share of a force that is left when so much of its release is still to come."""
    return left * left * (3.0 - 2.0 * left)


def in_release(released: Vec3, left: float) -> SafetyState:
    """A hand that is being let go."""
    force = scale(released, smooth(left))
    return SafetyState(force=force, now=0.0, fault="a fault", released=released, left=left)


states = st.one_of(
    st.just(SafetyState()),
    pressed,
    st.builds(in_release, vectors(5.0), st.floats(0.0, 1.0, exclude_min=True)),
)


friendly = st.builds(
    Period,
    wanted=forces,
    velocity=st.just(ZERO),
    silent=st.booleans(),
    dt=st.floats(0.0, 0.9 * LIMITS.stall),
)


GUARD = [rule for rule in CHAIN if rule.name in ("fault", "limit", "fade", "rate")]
SEEN = Sight(-1.0, (0.0, 0.0, 1.0), 1e-3, ZERO, ZERO)  # of a surface that is shown


def guard(
    state: SafetyState, requested: Vec3, *, now: float, velocity: Vec3, silent: bool,
    limits: SafetyLimits, held: bool = True, own: float = math.inf,
) -> SafetyState:  # fmt: skip
    """The memory after the four rules of the guard, in one period.

    Args:
        requested: Force of law, friction and damping [N].
        own: Largest change of the force that the hand's displacement explains [N].
    """
    sample = DeviceSample(ZERO, velocity, buttons=SWITCH if held else 0)
    period = one.Period(LoopState(safety=state), sample, now, LoopSettings(1.0 / 60.0, limits))
    period.asked, period.silent, period.sight = requested, silent, SEEN
    # A displacement of 1 m, on a spring that makes so much of it.
    period.moved, period.fade = (1.0, 0.0, 0.0), LawFade(Running(DEFAULT_LAW, Gains(own)))
    for rule in GUARD:
        rule.apply(period)
    return period.safety


def play(
    state: SafetyState, periods: list[Period], limits: SafetyLimits = LIMITS
) -> list[SafetyState]:
    """Every state on the way, the first included."""
    now, seen = 0.0 if state.now is None else state.now, [state]
    for p in periods:
        now += p.dt
        state = guard(state, p.wanted, now=now, velocity=p.velocity, silent=p.silent, limits=limits)
        seen.append(state)
    return seen


def clamped(force: Vec3) -> Vec3:
    """As much of a force as a hand may get."""
    return scale(force, min(1.0, LIMITS.max_force / (norm(force) or 1.0)))


def pressing(force: Vec3) -> SafetyState:
    """A hand that has been given `force` for long, or as much of it as it may get."""
    return replace(PRESSED, force=clamped(force))


def counted(period: Period) -> float:
    """Time of a period in which a force may move [s]."""
    return min(period.dt, 2.0 * PERIOD)
