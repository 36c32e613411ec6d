"""The law in use, and the change from one law to the next without a step in the force.

When patches come for another law, both laws run, and the force moves from the old to the new one. A
change takes at least `LAW_FADE_TIME`; it moves the force by at most `LAW_FADE_SHARE_RATE` of itself
and `LAW_FADE_RATE` per second.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from cohaptic.control.geometry import Sight
from cohaptic.control.law import (
    AT_REST,
    Gains,
    Law,
    LawSettings,
    LocalForce,
    local_force,
    pressed_depth,
)
from cohaptic.control.proportional_integral import IntegralState
from cohaptic_client.loop.safety import EXTERNAL_RATE

LAW_FADE_TIME: Final = 0.3  # s
LAW_FADE_SHARE_RATE: Final = 10.0  # 1/s; 1 % of the force per millisecond
LAW_FADE_RATE: Final = 0.5 * EXTERNAL_RATE  # N/s; the other half is left for the surface
_LEAST_FORCE: Final = 0.05  # N; with a share of a smaller force a change would never end


@dataclass(init=False)
class Running:
    """A running law, with its gains and its memory.

    Fields:
        law: Local model.
        gains: Gains in use.
        memory: Memory of the law's integral.
    """

    law: Final[Law]
    gains: Final[Gains]
    memory: Final[IntegralState]

    def __init__(self, law: Law, gains: Gains, memory: IntegralState = AT_REST) -> None:
        self.law = law
        self.gains = gains
        self.memory = memory


@dataclass(init=False)
class LawFade:
    """The law in use and the law that it replaces.

    Fields:
        now: Law in use.
        before: Law that `now` replaces; None when the change is over.
        share: Share of `now` in the force, 0 to 1.
    """

    now: Final[Running]
    before: Final[Running | None]
    share: Final[float]

    def __init__(self, now: Running, before: Running | None = None, share: float = 1.0) -> None:
        self.now = now
        self.before = before
        self.share = share


def switch(
    fade: LawFade, law: Law, gains: Gains, *, force: float = 0.0, sight: Sight | None = None
) -> LawFade:
    """Begin to change to `law`; the present law runs beside it until the change is over.

    During a change, a return to the old law begins at once. A third law waits for the end of the
    change; later patches ask for it again. The integral of the new law starts at the value that
    gives the force of the old law: from zero it would wind up while the old law still carries the
    contact.

    Args:
        fade: Law in use.
        law: Law that is asked for.
        gains: Gains of that law.
        force: Normal force now [N].
        sight: Surface sample of the surface now; None if no surface has been shown.
    """
    if law is fade.now.law:
        return fade
    if fade.before is None:
        memory = AT_REST
        if sight is not None and law.integrates:
            depth = pressed_depth(law, sight)
            memory = IntegralState(max(0.0, force - gains.k_h * depth), 0.0, depth)
        return LawFade(Running(law, gains, memory), fade.now, 0.0)
    if law is fade.before.law:
        return LawFade(fade.before, fade.now, 1.0 - fade.share)
    return fade


def stiffest(fade: LawFade) -> float:
    """Gain K_h in use; while one law replaces another, the larger gain of the two [N/m]."""
    k_h = fade.now.gains.k_h
    if fade.before is not None and fade.before.gains.k_h > k_h:
        return fade.before.gains.k_h
    return k_h


def with_gains(fade: LawFade, gains: Gains) -> LawFade:
    """The same fade with other gains for the law in use."""
    now = fade.now
    if gains.k_h == now.gains.k_h and gains.integral_gain == now.gains.integral_gain:
        return fade
    return LawFade(Running(now.law, gains, now.memory), fade.before, fade.share)


def run(
    fade: LawFade, sight: Sight, dt: float, settings: LawSettings
) -> tuple[LawFade, LocalForce]:
    """Run the law in use and the law that it replaces for one period; returns state and force."""
    memory, force = local_force(fade.now.law, fade.now.memory, sight, fade.now.gains, dt, settings)
    if fade.before is None and memory is fade.now.memory:
        return fade, force
    now = Running(fade.now.law, fade.now.gains, memory)
    if fade.before is None:
        return LawFade(now), force
    old = fade.before
    memory, old_force = local_force(old.law, old.memory, sight, old.gains, dt, settings)
    gap = abs(force.normal_force - old_force.normal_force)
    present = old_force.normal_force + fade.share * (force.normal_force - old_force.normal_force)
    step = dt / LAW_FADE_TIME
    if gap > 0.0:
        step = min(
            step, min(LAW_FADE_RATE, LAW_FADE_SHARE_RATE * max(present, _LEAST_FORCE)) * dt / gap
        )
    share = min(1.0, fade.share + step)
    if share >= 1.0:
        return LawFade(now), force
    return LawFade(now, Running(old.law, old.gains, memory), share), _mixed(old_force, force, share)


def _mixed(a: LocalForce, b: LocalForce, share: float) -> LocalForce:
    """Interpolate between the forces of two laws, from `a` (share 0) to `b` (share 1)."""
    return LocalForce(
        a.normal_force + share * (b.normal_force - a.normal_force),
        a.felt_from_others + share * (b.felt_from_others - a.felt_from_others),
        a.indentation + share * (b.indentation - a.indentation),
        a.stored + share * (b.stored - a.stored),
    )
