"""The model of one user's hand, which follows what its samples say (science 3.15)."""

from __future__ import annotations

import math
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
# Of a client's clock, which may say anything: beyond, adding a window changes nothing any more.
_LATEST: Final = 1e9  # s
# s between two samples; a window with a longer gap says nothing. As the wait after which playing
# counts a link as stalled (`playout.LONGEST`). Reasoned, not measured.
_LONGEST_GAP: Final = 0.25
# s; about half of a period at 120 samples a second. A sample that follows closer is left out: times
# are what a client says, and a curve through values with next to no time between them has no bound.
# It also bounds the number of samples.
_SHORTEST_GAP: Final = 0.004
_LEAST_SAMPLES: Final = 20  # in a window, at 10 ticks per second
# 1/s, of the logarithms of a told hand that changes: as fast as clients let models change.
REPORT_RATE: Final = 1.0
# s; time constant of the largest force that a hand has told: a tap is remembered until the next
# one. Reasoned, not measured.
_FORGET: Final = 0.5
# N/s; 6 N within 0.1 s, as `applied_forces.EFFECT_RATE`. A force that is told for a tick now and
# then, which the body's own limits hardly let through, gives no model more.
_RISE: Final = 60.0
# Of the lag of a hand that is not doubted any more: what it wants then comes a tenth faster. A lag
# that jumped down moved it by 2 mm in a tick (science 3.15, Told).
_BELIEVE: Final = 0.1


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
        due: Time of the server's clock at which the next window is taken in [s].
        peak: Largest force into the object that the hand has told lately [N].
        reported: Whether its client simulates and tells the hand.
        doubted: Least lag with which it is heard, since it told something implausible [s].
    """

    clouds: Clouds
    samples: tuple[Sampled, ...] = ()
    model: HandModel = USUAL_HAND
    lag: float = FIRST_LAG
    wanted: tuple[HandModel, float] = (USUAL_HAND, FIRST_LAG)
    due: float = 0.0
    peak: float = 0.0
    reported: bool = False
    doubted: float = 0.0

    def ready(self, now: float) -> bool:
        """Return whether a whole window has come, and time has passed since the last one."""
        if now < self.due or len(self.samples) < _LEAST_SAMPLES:
            return False
        return self.samples[-1].t - self.samples[0].t >= WINDOW


def unknown(user: int) -> Learned:
    """Return what is known of the hand of a user who has just come."""
    return Learned(Clouds.of(1, seed=user))


def known(learned: Learned | None, user: int, hand: HandModel) -> Learned:
    """Return what is known of a simulated hand, whose client tells it.

    What such a hand wants is told, and needs no lag: while it presses, nothing loops through it
    (science 3.15). Where it gives way on purpose, which a force makes it do, it is about to let go.

    Args:
        learned: What was known; None before the first sample.
        user: Number of the user.
        hand: The hand.
    """
    if learned is None or not learned.reported:
        return replace(unknown(user), model=hand, lag=0.0, wanted=(hand, 0.0), reported=True)
    return replace(learned, wanted=(hand, 0.0))


def hear(learned: Learned, touch: Touch) -> Learned:
    """Return what is known with a user's newest sample kept for the next window."""
    samples, one = learned.samples, Sampled(touch.t_client, touch.probe, touch.force)
    if abs(one.t) > _LATEST or (samples and not one.t - samples[-1].t >= _SHORTEST_GAP):
        return learned
    if not samples or one.t - samples[-1].t > _LONGEST_GAP:
        return replace(learned, samples=(one,))
    first = next(i for i, old in enumerate(samples) if old.t > one.t - WINDOW - _LONGEST_GAP)
    return replace(learned, samples=(*samples[first:], one))


def glide(learned: Learned, force: float, dt: float) -> Learned:
    """Return what is known after a time, with model and lag nearer to the wanted ones.

    Args:
        learned: What was known.
        force: Force into the object that the hand tells [N].
        dt: Time [s].
    """
    peak = max(min(force, learned.peak + _RISE * dt), learned.peak * math.exp(-dt / _FORGET))
    learned = replace(learned, peak=peak, doubted=max(0.0, learned.doubted - _BELIEVE * dt))
    model, late = learned.wanted
    if learned.model == model and learned.lag == late:
        return learned
    if learned.reported:
        reported = [
            _glided(a, b, REPORT_RATE * dt) for a, b in zip(learned.model, model, strict=True)
        ]
        return replace(learned, model=HandModel(*reported))
    in_need = np.array(late > learned.lag)
    moved = towards(np.array(learned.model), np.array(model), in_need, dt)
    slower = lag_towards(np.array([learned.lag]), np.array([late]), dt)
    return replace(learned, model=HandModel(*moved.tolist()), lag=float(slower[0]))


def _glided(now: float, then: float, limit: float) -> float:
    change = math.log(then / now)
    return then if abs(change) <= limit else now * math.exp(math.copysign(limit, change))


def learn(
    learned: Learned,
    C: Floats,
    models: Sequence[HandModel],
    row: int,
    touching: Mask,
    now: float,
) -> Learned:
    """Return what is known with the window that is complete.

    Args:
        learned: What was known.
        C: Compliance between the contacts of all hands, shape (n, n) [m/N].
        models: Models of all hands.
        row: Row of this hand.
        touching: Whether each hand presses, shape (n,).
        now: Time on the server's clock [s].
    """
    learned = replace(learned, due=now + STEP)
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
    contact = closed / surroundings(C, taken, BANDS).compliance[place]
    window = seen(-(tips @ (mean / size))[None], force[None])
    clouds = learned.clouds.after(window, contact[None])
    around = surroundings(C, taken, FREQUENCIES)
    mine = Surroundings(around.compliance[place][None], around.fraction[place][None])
    late = float(lag(mine, clouds.hands[:, ::2], np.array([learned.model]))[0])
    return replace(learned, clouds=clouds, wanted=(HandModel(*clouds.mean[0].tolist()), late))
