"""Hands that are estimated: pushed by others, moving by themselves, and both."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_experiments.partner_models.hand_estimate import BANDS, BLOCK, WINDOW, Clouds, seen
from cohaptic_server.numeric import Floats

CONTACT = np.full((1, len(BANDS)), 325.0 + 0.0j)  # N/m; a contact beside hands that hold still
BLOCKS = round(WINDOW / 0.001 / BLOCK)

masses, dampings, stiffnesses = st.floats(0.05, 0.5), st.floats(1.5, 10.0), st.floats(100.0, 1000.0)


def move(hand: Floats, wanted: Floats, pushed: Floats) -> tuple[Floats, Floats]:
    """Depth and force of a hand at a contact that others push out by `pushed` [m], in blocks."""
    m, b, k = hand
    x = v = 0.0
    xs, fs = np.empty(len(wanted)), np.empty(len(wanted))
    for t in range(len(wanted)):
        xs[t], fs[t] = x, 325.0 * (x + pushed[t])
        v = (v + 0.001 / m * (k * (wanted[t] - x) - fs[t])) / (1.0 + 0.001 * b / m)
        x += 0.001 * v
    return xs.reshape(-1, BLOCK).mean(axis=1), fs.reshape(-1, BLOCK).mean(axis=1)


def take_all(clouds: Clouds, x: Floats, f: Floats) -> None:
    for end in range(BLOCKS, len(x) + 1, BLOCKS // 2):
        part = slice(end - BLOCKS, end)
        clouds.take(seen(x[None, part], f[None, part]), CONTACT)


def noise(seed: int, size: float, seconds: float) -> Floats:
    """Smooth random motion up to about 8 Hz [m]."""
    t = 0.001 * np.arange(round(1000 * seconds))
    rng = np.random.default_rng(seed)
    f, phase = rng.uniform(0.5, 8.0, 12), rng.uniform(0.0, 6.3, 12)
    return np.asarray(size / 3.0 * np.sin(2.0 * np.pi * f * t[:, None] + phase).sum(axis=1))


@given(masses, dampings, stiffnesses, st.integers(0, 99))
@settings(max_examples=15, deadline=None)
def test_the_right_hand_leaves_nothing_unexplained(m: float, b: float, k: float, seed: int) -> None:
    hand, pushed = np.array([m, b, k]), noise(seed, 2e-3, 4.0)
    x, f = move(hand, np.full(len(pushed), 3e-3), pushed)
    window = seen(x[None, -BLOCKS:], f[None, -BLOCKS:])
    left = np.abs(window.intended(hand[None, None]))[0, 0]
    assert left.max() < 0.04 * np.abs(window.force).max()


@given(masses, dampings, stiffnesses)
@settings(max_examples=8, deadline=None)
def test_a_hand_that_others_push_is_known_within_a_few_seconds(
    m: float, b: float, k: float
) -> None:
    hand, clouds = np.array([m, b, k]), Clouds(1)
    pushed = noise(1, 3e-3, 10.0)
    take_all(clouds, *move(hand, noise(2, 0.1e-3, 10.0), pushed))
    z, found = ((h[2] - h[0] * w**2 + 1j * h[1] * w) for h in (hand, clouds.mean[0])
                for w in (2.0 * np.pi * np.arange(1.0, 8.0),))  # fmt: skip
    assert np.abs(found / z - 1.0).mean() < 0.35


@given(st.integers(0, 99))
@settings(max_examples=8, deadline=None)
def test_own_motion_alone_says_nothing(seed: int) -> None:
    clouds, hand = Clouds(1, seed=seed), np.array([0.3, 3.0, 800.0])
    before = np.log(clouds.mean[0])
    wanted = noise(seed, 5e-3, 8.0)
    take_all(clouds, *move(hand, wanted, np.zeros(len(wanted))))
    # A regression of the force would say -325 N/m, and the ends of the cloud are far away.
    assert np.abs(np.log(clouds.mean[0]) - before).max() < 0.5
    assert (clouds.spread[0] > 0.3).all()


def test_a_hand_at_rest_leaves_its_cloud_as_it_is() -> None:
    clouds = Clouds(2)
    before, spread = clouds.mean, clouds.spread
    rest = np.full((2, BLOCKS), 0.004)
    for _ in range(5):
        clouds.take(seen(rest, 300.0 * rest), np.repeat(CONTACT, 2, axis=0))
    assert clouds.mean == pytest.approx(before, rel=0.3)
    assert clouds.spread == pytest.approx(spread, rel=0.3)
