"""Rules on what the hand meets: its own tip, the shown surface, and models of the other hands."""

from __future__ import annotations

from typing import Final

from cohaptic.protocol.frame import MAX_POSITION
from cohaptic.status.reason import JUMPED, OUT_OF_REACH
from cohaptic.vec import dot, norm, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.answer import WISH_RATE, WISH_RATE_IN_FADES, OwnHand, answer
from cohaptic_client.loop.arrival import is_silent, play, progress, shown
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.replica import recent_speed
from cohaptic_client.loop.rule import Rule
from cohaptic_client.loop.safety import NO_TROUBLE, SafetyLimits, Trouble
from cohaptic_client.loop.state import LoopState

_REACH: Final = MAX_POSITION * MAX_POSITION  # m^2; largest squared distance of a tip


class Reach(Rule):
    """Finds a tip that is nowhere, or that jumps; keeps the last place of one out of reach."""

    def apply(self, period: Period) -> None:
        """Fill in `trouble`, and replace `sample` where its place is none."""
        sample, state = period.sample, period.state
        period.trouble = trouble_of(state, sample, period.now, period.settings.limits)
        if period.trouble.cause and not norm(sample.position) <= MAX_POSITION:
            period.sample = DeviceSample(state.probe, sample.velocity, sample.level, sample.buttons)


def trouble_of(state: LoopState, sample: DeviceSample, now: float, limits: SafetyLimits) -> Trouble:
    """Return the fault in a device's sample; `NO_TROUBLE` if there is none.

    A fault is a position beyond `MAX_POSITION` or a jump of the tip. The check compares positions,
    because the driver may state any velocity: a tip that jumps has moved faster than `max_speed`,
    whatever the sample's velocity is.

    Args:
        state: State after the last period.
        now: Time of this period [s].
    """
    # Without calls, because this runs in every period and mostly finds nothing.
    (x, y, z), (x0, y0, z0) = sample.position, state.probe
    if not x * x + y * y + z * z <= _REACH:  # NaN too
        words = f"the device is at {sample.position} m, beyond {MAX_POSITION:g} m"
        return Trouble(OUT_OF_REACH, words)
    if state.safety.now is None:
        return NO_TROUBLE
    passed = now - state.safety.now
    limit = limits.max_speed * (passed + limits.stale if passed > 0.0 else limits.stale)
    if (x - x0) * (x - x0) + (y - y0) * (y - y0) + (z - z0) * (z - z0) > limit * limit:
        way = norm(sub(sample.position, state.probe))
        words = f"the device jumped by {1e3 * way:.0f} mm, faster than {limits.max_speed:g} m/s"
        return Trouble(JUMPED, words)
    return NO_TROUBLE


class Shown(Rule):
    """Moves the shown surface on its way from patch to patch, and samples it at the probe."""

    def apply(self, period: Period) -> None:
        """Fill in `silent`, `fraction`, `sight` and the displacement of the hand."""
        state, now, settings = period.state, period.now, period.settings
        period.silent = is_silent(state, now, settings)
        if state.coming:
            state = period.state = play(state, now, settings)
        period.fraction = progress(state, now)
        period.sight = shown(state, period.sample.position, period.fraction)
        if period.sight is not None:
            period.fade = state.fade
            period.moved = sub(period.sample.position, state.probe)


class Models(Rule):
    """Replaces the forces of the others in the surface by those that models of them have now."""

    def apply(self, period: Period) -> None:
        """Fill in `answered`, `recent`, `model_change` and `wished`, and replace `sight`."""
        state, sight = period.state, period.sight
        replica = period.replica = state.replica
        if sight is None or replica is None:
            return
        patch, settings = state.patch, period.settings
        assert patch is not None
        moved_in = dot(sight.normal, sub(state.probe, period.sample.position))
        period.recent = recent_speed(replica.recent, moved_in, period.counted)
        fades = period.silent or state.safety.scale < 1.0
        fades = fades or (state.fade is not None and state.fade.before is not None)
        own = OwnHand(
            state.k_h, patch.c_ii, settings.limits.max_force, state.safety.scale,
            settings.max_stiffness, moved_in, period.recent.speed,
            WISH_RATE_IN_FADES if fades else WISH_RATE, state.trust.fraction,
        )  # fmt: skip
        answered = answer(replica, sight, period.fraction, own, period.counted)
        period.answered = answered
        period.sight = answered.sight
        period.model_change, period.wished = answered.model_change, answered.wished
