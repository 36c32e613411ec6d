"""The model of one user's hand, which follows what its samples say (science 3.15)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from cohaptic.control.hand_model import USUAL_HAND, HandModel
from cohaptic.vec import Vec3
from cohaptic_server.numeric import Floats, Mask
from cohaptic_server.world.partners.hand_estimate import BANDS, STEP, WINDOW, Clouds, on_grid, seen
from cohaptic_server.world.partners.small_gain import (
    FREQUENCIES,
    Surroundings,
    lag,
    lag_towards,
    surroundings,
    towards,
)
from cohaptic_server.world.state import NEGLIGIBLE, Touch

# s of the lag with which others learn what a hand wants, before anything is known of the hand. With
# 40 ms, the loop between 300 pairs of hands of 0.05 to 0.5 kg, 1 to 10 N s/m and 100 to 1,000 N/m
# that are taken for the usual hand had a gain below 1 on the balloon and on 3,000 N/m.
FIRST_LAG: Final = 0.04
_LONGEST_GAP: Final = 0.25  # s between two samples; a window with a longer gap says nothing
_MOST_SAMPLES: Final = 512  # more than a window has at 200 ticks per second


class Sampled(NamedTuple):
    """Tip [m] and force on the hand [N] at a time of the client's clock [s]."""

    t: float
    tip: Vec3
    force: Vec3


@dataclass(frozen=True, eq=False, slots=True)
class Learned:
    """What is known of one user's hand.

    Args:
        clouds: Hands that it may be.
        samples: Samples of the last window, oldest first.
        model: Model that its client moves.
        lag: Lag with which others learn what it wants [s].
        wanted: Model and lag towards which these move.
        due: Time of the client's clock at which the next window is complete [s].
    """

    clouds: Clouds
    samples: tuple[Sampled, ...] = ()
    model: HandModel = USUAL_HAND
    lag: float = FIRST_LAG
    wanted: tuple[HandModel, float] = (USUAL_HAND, FIRST_LAG)
    due: float = 0.0

    @property
    def ready(self) -> bool:
        """Whether a window has come since the last one that was taken in."""
        return bool(self.samples) and self.samples[-1].t >= self.due


def unknown(user: int) -> Learned:
    """Return what is known of the hand of a user who has just come."""
    return Learned(Clouds.of(1, seed=user))


def hear(learned: Learned, touch: Touch) -> Learned:
    """Return what is known with a user's newest sample kept for the next window."""
    samples = learned.samples
    if samples and touch.t_client <= samples[-1].t:
        return learned
    one = Sampled(touch.t_client, touch.probe, touch.force)
    if not samples or one.t - samples[-1].t > _LONGEST_GAP:
        return replace(learned, samples=(one,), due=one.t + WINDOW)
    first = next(i for i, old in enumerate(samples) if old.t > one.t - WINDOW - _LONGEST_GAP)
    first = max(first, len(samples) + 1 - _MOST_SAMPLES)
    return replace(learned, samples=(*samples[first:], one))


def glide(learned: Learned, dt: float) -> Learned:
    """Return what is known after a time [s], with model and lag nearer to the wanted ones."""
    model, late = learned.wanted
    if learned.model == model and learned.lag == late:
        return learned
    moved = towards(np.array(learned.model), np.array(model), dt)
    slower = lag_towards(np.array([learned.lag]), np.array([late]), dt)
    return replace(learned, model=HandModel(*moved.tolist()), lag=float(slower[0]))


def learn(
    learned: Learned, C: Floats, models: Sequence[HandModel], row: int, touching: Mask
) -> Learned:
    """Return what is known with the window that is complete.

    Args:
        learned: What was known.
        C: Compliance between the contacts of all hands, shape (n, n) [m/N].
        models: Models of all hands.
        row: Row of this hand.
        touching: Whether each hand presses, shape (n,).
    """
    learned = replace(learned, due=learned.samples[-1].t + STEP)
    times = np.array([sample.t for sample in learned.samples])
    tips = on_grid(times, np.array([sample.tip for sample in learned.samples])).T
    pushes = on_grid(times, np.array([sample.force for sample in learned.samples])).T
    mean = pushes.mean(axis=0)
    size = float(np.linalg.norm(mean))
    if size < NEGLIGIBLE or not touching[row]:
        return learned
    force = pushes @ (mean / size)
    closed = float((force > NEGLIGIBLE).mean())
    place = int(touching[:row].sum())
    C, taken = C[np.ix_(touching, touching)], np.array(models)[touching]
    contact = closed / surroundings(C, taken, BANDS).give[place]
    window = seen(-(tips @ (mean / size))[None], force[None])
    clouds = learned.clouds.after(window, contact[None])
    around = surroundings(C, taken, FREQUENCIES)
    mine = Surroundings(around.give[place][None], around.share[place][None])
    late = float(lag(mine, clouds.hands[:, ::2], np.array([learned.model]))[0])
    return replace(learned, clouds=clouds, wanted=(HandModel(*clouds.mean[0].tolist()), late))
