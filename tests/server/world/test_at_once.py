"""Hands without a network, against the equilibrium and against the equations of motion."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cohaptic.simulated.hand import Hand, HandState, ease, move
from cohaptic.vec import ZERO, Vec3, scale
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.spring import Spring, SpringSettings
from cohaptic_server.numeric import Floats
from cohaptic_server.world.at_once import PERIOD, Mover, TouchAtOnce, play_at_once
from cohaptic_server.world.equilibrium import RestingHand, solve

RADIUS = 0.1  # m, of the balloon
USUAL = Hand()
DEPTH = 0.008  # m


def wanted(angle: float, depth: float) -> Vec3:
    return scale((math.cos(angle), math.sin(angle), 0.0), RADIUS - depth)


def pressing(angle: float, depths: Floats, hand: Hand = USUAL) -> Mover:
    """A hand whose intended depth follows `depths`, one for each period [m]."""
    state = HandState(wanted(angle, float(depths[0])), ZERO)

    def mover(now: float, force: Vec3) -> Vec3:
        nonlocal state
        depth = float(depths[min(round(now / PERIOD), len(depths) - 1)])
        state = move(state, hand, wanted(angle, depth), force, PERIOD)
        return state.position

    return mover


def approach(depth: float, seconds: float) -> Floats:
    t = PERIOD * np.arange(round(seconds / PERIOD))
    return np.array([-0.005 + (depth + 0.005) * ease(at / 0.3) for at in t.tolist()])


@pytest.mark.parametrize("angles", [(0.0, math.pi), (0.0, 2.1, 4.2)])
def test_hands_come_to_rest_in_the_equilibrium(
    small_balloon: Balloon, angles: tuple[float, ...]
) -> None:
    depths = approach(DEPTH, 1.5)
    motion = play_at_once(small_balloon, [pressing(a, depths) for a in angles], 1.5)
    expected = solve(
        small_balloon, [RestingHand(wanted(a, DEPTH), USUAL.stiffness) for a in angles]
    )
    assert motion.force[:, -1] == pytest.approx(expected.force, rel=2e-3)
    assert motion.from_others[:, -1] == pytest.approx(expected.felt_from_others, rel=5e-3)
    assert motion.tips[:, :, -1] == pytest.approx(expected.tip, abs=2e-5)


def test_a_hand_on_a_spring_moves_by_its_own_equation() -> None:
    """Mass, damper and two springs, solved exactly: the step of a damped oscillator."""
    k_o, step = 200.0, 0.002
    body = Spring(SpringSettings(k_o=k_o))
    depths = approach(0.01, 2.0)
    depths[1000:] += step
    state = HandState((0.01, 0.0, 0.0), ZERO)

    def mover(now: float, force: Vec3) -> Vec3:
        nonlocal state
        depth = float(depths[min(round(now / PERIOD), len(depths) - 1)])
        state = move(state, USUAL, (-depth, 0.0, 0.0), force, PERIOD)
        return state.position

    motion = play_at_once(body, [mover], 2.0)
    m, b, k = USUAL.mass, USUAL.damping, USUAL.stiffness
    decay, t = b / (2.0 * m), PERIOD * np.arange(1, 1001)
    w = math.sqrt((k + k_o) / m - decay * decay)
    fraction = 1.0 - np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t))
    # The force is held for a period, which damps by half a period's stiffness less: 0.1 of 8 N s/m.
    true = k_o * k / (k + k_o) * (0.01 + step * fraction)
    assert motion.force[0, 999:1999] == pytest.approx(true, abs=0.03 * k_o * step)


def test_the_force_on_one_hand_follows_the_other_within_some_instants(
    small_balloon: Balloon,
) -> None:
    """Tips are moved, not hands; contacts slide to where the surface has turned."""
    touch = TouchAtOnce(small_balloon, 2)
    tips = [wanted(0.0, DEPTH), wanted(math.pi, DEPTH)]
    before = [touch.felt(tips) for _ in range(60)][-1]
    tips[0] = wanted(0.0, DEPTH + 1e-4)
    changes = [touch.felt(tips).force - before.force for _ in range(60)]
    largest = float(np.abs(changes[-1]).max())
    assert np.abs(changes[0][1]).max() > 0.3 * largest  # at once
    assert changes[10] == pytest.approx(changes[-1], abs=0.01 * largest)
