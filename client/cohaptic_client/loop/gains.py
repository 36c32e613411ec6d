"""The law's gains at the probe, and the way from those before a patch to its own."""

from __future__ import annotations

from typing import Final

from cohaptic.control.geometry import Sight
from cohaptic.control.law import Gains
from cohaptic.protocol.patch import MIN_COMPLIANCE, Patch
from cohaptic_client.loop.law_fade import LawFade, with_gains
from cohaptic_client.loop.slew import slew_gain
from cohaptic_client.loop.state import LoopSettings, LoopState

MOST_CHANGE: Final = 2.0  # of a compliance within one patch; more is a mistake of the patch
_AS_STIFF: Final = 1.0 - 1e-5  # K_h C_ii of a hand that has the object's own stiffness, in 32 bits


def gains_as_sent(patch: Patch, settings: LoopSettings) -> Gains:
    """The gains that a patch states, K_h no larger than the device renders stably."""
    return Gains(min(patch.k_h, settings.max_stiffness), patch.integral_gain)


def gains_under(patch: Patch, sight: Sight, settings: LoopSettings) -> Gains:
    """The gains of a patch at the present position of the probe.

    They are shares of 1 / C_ii, which changes along a body: from the balloon's equator to its pole
    by half. A mesh patch knows it under the probe; the others know their own contact's.
    """
    if not settings.follow:
        return gains_as_sent(patch, settings)
    least, most = patch.c_ii / MOST_CHANGE, patch.c_ii * MOST_CHANGE
    c_ii = max(MIN_COMPLIANCE, least, min(most, sight.c_ii))
    if not patch.law.answers_own_dent:
        # The object's stiffness here, or the device's where the server says that it is softer.
        limit = settings.max_stiffness
        if patch.k_h * patch.c_ii < _AS_STIFF:
            limit = min(limit, patch.k_h)
        return Gains(min(1.0 / c_ii, limit), patch.integral_gain)
    ratio = patch.c_ii / c_ii
    k_h = min(patch.k_h * ratio, settings.max_stiffness)
    return Gains(k_h, patch.integral_gain * ratio)


def follow_gains(
    state: LoopState,
    patch: Patch,
    fade: LawFade,
    sight: Sight,
    share: float,
    counted: float,
    settings: LoopSettings,
) -> LawFade:
    """The law in use with the gains of the newest patch, on the way from those before.

    Args:
        state: After the last period.
        patch: Newest patch, for the law in use.
        fade: Law in use.
        sight: Surface sample of the surface now.
        share: Share of the way to the newest patch that is done, 0 to 1.
        counted: Time since the last period, as far as it counts [s].
        settings: Settings of the loop.
    """
    newest = gains_under(patch, sight, settings)
    target = state.k_h_before + share * (newest.k_h - state.k_h_before)
    k_h = slew_gain(fade.now.gains.k_h, target, counted, state.normal_force)
    gains = newest if k_h == newest.k_h else Gains(k_h, newest.integral_gain)
    return with_gains(fade, gains)
