"""The law in use, and the transition from one law to the next without a step in the force.

When patches for another law arrive, both laws run, and the force moves from the old law's force to
the new one's. A transition takes at least `LAW_FADE_TIME`. It changes the force by at most
`LAW_FADE_RATE` [N/s], and relative to the force by at most `LAW_FADE_FRACTION_RATE` [1/s].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from cohaptic.control.geometry import Sight
from cohaptic.control.law import Law, pressed_depth
from cohaptic.control.laws.model import Gains, LawSettings, LocalForce
from cohaptic_client.loop.safety import EXTERNAL_RATE

# s; a hand that presses on purpose takes about as long, so that the new law is met as a press is.
# Reasoned, not measured.
LAW_FADE_TIME: Final = 0.3
# 1/s; 1 % of the force per millisecond, as `GAIN_RATE` (test_law_fade.py). Reasoned, not measured.
LAW_FADE_FRACTION_RATE: Final = 10.0
# N/s; the other half is left for the surface, as in a turn (science 3.9).
LAW_FADE_RATE: Final = 0.5 * EXTERNAL_RATE
# N; at a rate relative to a smaller force a transition would never end. A fingertip hardly notices
# a change of so much (`EXTERNAL_RATE`).
_LEAST_FORCE: Final = 0.05


@dataclass(init=False)
class Running:
    """A running law, with its gains and the memory of its integral.

    Fields:
        law: Local model.
        gains: Gains in use.
        memory: Memory of the law; None before the first period.
    """

    law: Final[Law]
    gains: Final[Gains]
    memory: Final[object]

    def __init__(self, law: Law, gains: Gains, memory: object = None) -> None:
        self.law = law
        self.gains = gains
        self.memory = memory


@dataclass(init=False)
class LawFade:
    """The law in use and, during a transition, the law that it replaces.

    Fields:
        now: Law in use.
        before: Law that `now` replaces; None outside a transition.
        fraction: Weight of the force of `now` in the whole force, 0 to 1; `before` has the rest.
    """

    now: Final[Running]
    before: Final[Running | None]
    fraction: Final[float]

    def __init__(self, now: Running, before: Running | None = None, fraction: float = 1.0) -> None:
        self.now = now
        self.before = before
        self.fraction = fraction


def switch(
    fade: LawFade, law: Law, gains: Gains, *, force: float = 0.0, sight: Sight | None = None
) -> LawFade:
    """Begin the transition to `law`; the present law runs beside it until the transition is over.

    During a transition, a return to the old law begins at once, and a third law has to wait for the
    end; later patches request it again. The new law begins with the memory that gives the force of
    the old law.

    Args:
        fade: Law in use.
        law: Law that the newest patch is for.
        gains: Gains of that law.
        force: Present normal force [N].
        sight: Sample of the shown surface at the probe; None if no surface has been shown.
    """
    if law is fade.now.law:
        return fade
    if fade.before is None:
        memory = None
        if sight is not None:
            memory = law.model.begin(force, gains, pressed_depth(law, sight))
        return LawFade(Running(law, gains, memory), fade.now, 0.0)
    if law is fade.before.law:
        return LawFade(fade.before, fade.now, 1.0 - fade.fraction)
    return fade


def stiffest(fade: LawFade) -> float:
    """Return the gain K_h in use [N/m]; during a transition, the larger gain of the two laws."""
    k_h = fade.now.gains.k_h
    if fade.before is not None and fade.before.gains.k_h > k_h:
        return fade.before.gains.k_h
    return k_h


def with_gains(fade: LawFade, gains: Gains) -> LawFade:
    """Return the same laws with other gains for the law in use."""
    now = fade.now
    if gains.k_h == now.gains.k_h and gains.integral_gain == now.gains.integral_gain:
        return fade
    return LawFade(Running(now.law, gains, now.memory), fade.before, fade.fraction)


def run(
    fade: LawFade,
    sight: Sight,
    dt: float,
    settings: LawSettings,
    moved_in: float = 0.0,
    limit: float = math.inf,
    fade_limit: float = math.inf,
) -> tuple[LawFade, LocalForce]:
    """Run the law in use, and the law that it replaces, for one period.

    Args:
        sight: Sample of the shown surface at the probe.
        dt: Time since the last period [s].
        moved_in: Displacement of the hand into the surface since the last period [m].
        limit: Largest change of a law's force with an integral, as in `LocalModel.force` [N].
        fade_limit: Largest change of the force by the transition, beside `LAW_FADE_RATE` [N].

    Returns:
        The laws after this period, and the force.
    """
    memory, force = fade.now.law.model.force(
        fade.now.memory, sight, fade.now.gains, dt, settings, moved_in, limit
    )
    if fade.before is None and memory is fade.now.memory:
        return fade, force
    now = Running(fade.now.law, fade.now.gains, memory)
    if fade.before is None:
        return LawFade(now), force
    old = fade.before
    memory, old_force = old.law.model.force(
        old.memory, sight, old.gains, dt, settings, moved_in, limit
    )
    gap = abs(force.normal_force - old_force.normal_force)
    present = old_force.normal_force + fade.fraction * (force.normal_force - old_force.normal_force)
    step = dt / LAW_FADE_TIME
    if gap > 0.0:
        rate = min(LAW_FADE_RATE, LAW_FADE_FRACTION_RATE * max(present, _LEAST_FORCE))
        step = min(step, min(rate * dt, fade_limit) / gap)
    fraction = min(1.0, fade.fraction + step)
    if fraction >= 1.0:
        return LawFade(now), force
    return LawFade(now, Running(old.law, old.gains, memory), fraction), _mixed(
        old_force, force, fraction
    )


def _mixed(a: LocalForce, b: LocalForce, fraction: float) -> LocalForce:
    """Interpolate between the forces of two laws, from `a` (share 0) to `b` (share 1)."""
    return LocalForce(
        a.normal_force + fraction * (b.normal_force - a.normal_force),
        a.felt_from_others + fraction * (b.felt_from_others - a.felt_from_others),
        a.indentation + fraction * (b.indentation - a.indentation),
        a.stored + fraction * (b.stored - a.stored),
    )
