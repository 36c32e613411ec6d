"""Hands that are estimated: pushed by others, moving by themselves, and both."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic_server.numeric import Floats
from cohaptic_server.world.partners.hand_estimate import (
    BANDS,
    Clouds,
    Seen,
    on_grid,
    seen,
)

CONTACT = np.full((1, len(BANDS)), 325.0 + 0.0j)  # N/m; a contact beside hands that hold still
SAMPLES = 122  # at 60 samples per second, over a little more than a window

masses, dampings, stiffnesses = st.floats(0.05, 0.5), st.floats(1.5, 10.0), st.floats(100.0, 1000.0)


def move(hand: Floats, wanted: Floats, pushed: Floats) -> Floats:
    """Time, depth and force, 60 per second, at a contact that others push by `pushed` [m]."""
    m, b, k = hand
    x = v = 0.0
    xs, fs = np.empty(len(wanted)), np.empty(len(wanted))
    for t in range(len(wanted)):
        xs[t], fs[t] = x, 325.0 * (x + pushed[t])
        v = (v + 0.001 / m * (k * (wanted[t] - x) - fs[t])) / (1.0 + 0.001 * b / m)
        x += 0.001 * v
    sampled = np.round(np.arange(0.0, len(xs) - 0.5, 1000.0 / 60.0)).astype(np.int64)
    return np.asarray(np.stack([0.001 * sampled, xs[sampled], fs[sampled]], axis=1), np.float64)


def window_of(samples: Floats) -> Seen:
    """The window that ends with the last of some samples."""
    depth, force = on_grid(samples[:, 0], samples[:, 1:])
    return seen(depth[None], force[None])


def take_all(clouds: Clouds, samples: Floats) -> Clouds:
    for end in range(SAMPLES, len(samples) + 1, 60):
        clouds = clouds.after(window_of(samples[end - SAMPLES : end]), CONTACT)
    return clouds


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
    window = window_of(move(hand, np.full(len(pushed), 3e-3), pushed)[-SAMPLES:])
    left = np.abs(window.intended(hand[None, None]))[0, 0]
    assert left.max() < 0.04 * np.abs(window.force).max()


@given(masses, dampings, stiffnesses)
@settings(max_examples=8, deadline=None)
def test_a_hand_that_others_push_is_known_within_a_few_seconds(
    m: float, b: float, k: float
) -> None:
    hand, pushed = np.array([m, b, k]), noise(1, 3e-3, 10.0)
    clouds = take_all(Clouds.of(1), move(hand, noise(2, 0.1e-3, 10.0), pushed))
    z, found = ((h[2] - h[0] * w**2 + 1j * h[1] * w) for h in (hand, clouds.mean[0])
                for w in (2.0 * np.pi * np.arange(1.0, 8.0),))  # fmt: skip
    assert np.abs(found / z - 1.0).mean() < 0.35


@given(st.integers(0, 99))
@settings(max_examples=8, deadline=None)
def test_own_motion_alone_says_nothing(seed: int) -> None:
    clouds, hand = Clouds.of(1, seed=seed), np.array([0.3, 3.0, 800.0])
    before = np.log(clouds.mean[0])
    wanted = noise(seed, 5e-3, 8.0)
    clouds = take_all(clouds, move(hand, wanted, np.zeros(len(wanted))))
    # A regression of the force would say -325 N/m, and the ends of the cloud are far away.
    assert np.abs(np.log(clouds.mean[0]) - before).max() < 0.5
    assert (clouds.spread[0] > 0.3).all()
