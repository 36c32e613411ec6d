"""Rules on the force of the contact: the law, the damping of the passivity layer, and friction."""

from __future__ import annotations

import math
from typing import Final

from cohaptic.control.friction import friction_step
from cohaptic.protocol.frame import MAX_POSITION
from cohaptic.protocol.patch import MAX_STIFFNESS
from cohaptic.vec import add, dot, scale, sub
from cohaptic_client.loop.law_fade import LawFade, Running, run
from cohaptic_client.loop.passivity import dissipate
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.replica import fraction_answered
from cohaptic_client.loop.rule import Rule
from cohaptic_client.loop.rules.contact import held
from cohaptic_client.loop.trust import beyond

# N; as far as a filter of 50 ms is behind a force that changes as fast as others may change it
AHEAD: Final = 1.0
# N^2; square of the force of the stiffest surface at the greatest depth
_NO_FORCE: Final = (MAX_STIFFNESS * MAX_POSITION) ** 2


class LawForce(Rule):
    """Runs the law: from the depth to the normal force."""

    def apply(self, period: Period) -> None:
        """Fill in `local`, and with it the forces as they are without damping and friction."""
        sight, fade = period.sight, period.fade
        if sight is None or fade is None:
            return
        surface = held(period, sight)
        if period.memories:
            fade = not_wound_up(fade, period)
        fade, local = run(
            fade, surface, period.counted, period.settings.law, period.moved_in, period.max_change,
            period.law_fade_limit,
        )  # fmt: skip
        period.fade, period.local = fade, local
        period.damped_force = local.normal_force
        period.asked = period.law_force = scale(period.normal, local.normal_force)
        period.law_depth, period.law_normal = surface.depth, local.normal_force


def not_wound_up(fade: LawFade, period: Period) -> LawFade:
    """Return the laws with a memory no further ahead of the given force than `AHEAD`.

    A limit of another package takes force from the hand behind the law, whose integral would grow
    meanwhile, and be felt long after the hand has left.
    """
    now, state = fade.now, period.state
    limit = dot(state.safety.force, state.normal) + AHEAD
    memory = now.law.model.held_to(now.memory, limit, now.gains)
    if memory is now.memory:
        return fade
    return LawFade(Running(now.law, now.gains, memory), fade.before, fade.fraction)


class Damping(Rule):
    """Damps the hand while energy is owed that nobody spent."""

    def apply(self, period: Period) -> None:
        """Fill in `damping` and `damped_force`, and replace `asked`."""
        state, settings = period.state, period.settings
        if period.sight is None or settings.max_damping <= 0.0 or state.sight is None:
            return
        memory, speed_in = state.passivity, -dot(period.normal, period.sample.velocity)
        # Models that answer at once make no energy, and their loop is stable without damping
        # (science 3.15). The account is kept for the moment at which they no longer answer.
        owed = (1.0 - fraction_answered(state.replica, state.trust.fraction)) * memory.owed
        if state.replica is not None:  # unless they drive the hand
            owed += beyond(state.trust)
        force = period.local.normal_force
        period.damping, period.damped_force = dissipate(
            owed, memory.damping, force, speed_in, period.counted, settings.max_damping,
            period.damping_limit,
        )  # fmt: skip
        if period.damped_force != force:
            period.asked = scale(period.normal, period.damped_force)


class Friction(Rule):
    """Adds friction along the surface, from the tip's own motion and the material's."""

    def apply(self, period: Period) -> None:
        """Fill in `friction`, and add its force to `asked` and `law_force`."""
        C, sight, fade = period.compliance, period.sight, period.fade
        if C is None or sight is None or fade is None:
            return
        state, settings, moved = period.state, period.settings, period.moved
        if state.sight is not None and state.friction.touching:
            # The anchor lies `depth` away from the tip, along the normal of the last period. If the
            # surface has turned since, a part of that depth now lies along the surface.
            moved = sub(moved, scale(state.normal, max(0.0, state.depth)))
        friction = friction_step(
            state.friction,
            moved,
            sight.u_others,
            period.normal,
            period.local.normal_force,
            C,
            settings.friction,
            min(1.0, fade.now.gains.k_h * sight.c_ii),
            settings.max_stiffness,
            period.for_friction,
        )
        period.friction = friction
        period.asked = add(period.asked, friction.force)
        period.law_force = add(period.law_force, friction.force)


class Finite(Rule):
    """Finds a force that no spring can give, before its values stay in the loop's memory."""

    def apply(self, period: Period) -> None:
        """Raise `ValueError` for a force or depth that is not finite, or for a force too large."""
        (fx, fy, fz), (nx, ny, nz) = period.asked, period.normal
        if period.sight is None:
            return
        whole = nx + ny + nz + period.depth
        if not (fx * fx + fy * fy + fz * fz < _NO_FORCE and -math.inf < whole < math.inf):
            raise ValueError(f"{period.asked} N at a depth of {period.depth} m")
