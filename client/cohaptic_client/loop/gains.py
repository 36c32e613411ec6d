"""The law's gains at the probe, and their move from the previous gains to those of a new patch."""

from __future__ import annotations

from typing import Final

from cohaptic.control.geometry import Sight
from cohaptic.control.law import Gains
from cohaptic.protocol.patch import MIN_COMPLIANCE, Patch
from cohaptic_client.loop.law_fade import LawFade, with_gains
from cohaptic_client.loop.slew import slew_gain
from cohaptic_client.loop.state import LoopSettings, LoopState

# Largest factor by which a compliance changes within one patch; a larger one is the patch's error.
MOST_CHANGE: Final = 2.0
# Least K_h C_ii for which K_h counts as the object's stiffness 1 / C_ii, in 32 bits.
_AS_STIFF: Final = 1.0 - 1e-5


def gains_as_sent(patch: Patch, settings: LoopSettings) -> Gains:
    """The gains that a patch states, with K_h no larger than the device renders stably."""
    return Gains(min(patch.k_h, settings.max_stiffness), patch.integral_gain)


def gains_under(patch: Patch, sight: Sight, settings: LoopSettings) -> Gains:
    """The gains of a patch at the present position of the probe.

    Gains are shares of 1 / C_ii. The compliance C_ii of a contact varies over a body: on the
    balloon by half from the equator to the pole. A mesh patch has C_ii under the probe; other
    patches have C_ii at their own contact only.
    """
    if not settings.follow:
        return gains_as_sent(patch, settings)
    least, most = patch.c_ii / MOST_CHANGE, patch.c_ii * MOST_CHANGE
    c_ii = max(MIN_COMPLIANCE, least, min(most, sight.c_ii))
    if not patch.law.answers_own_dent:
        # The object's stiffness here, limited to the device's. A K_h that the server has made lower
        # than 1 / C_ii is a limit, too.
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
    """The law in use, with its gains moved one period further towards those of the newest patch.

    Args:
        state: State after the last period.
        patch: Newest patch, which is for the law in use.
        fade: Law in use.
        sight: Surface sample of the surface now.
        share: Share of the move to the newest patch that is done, 0 to 1.
        counted: Time since the last period, capped at two periods [s].
    """
    newest = gains_under(patch, sight, settings)
    target = state.k_h_before + share * (newest.k_h - state.k_h_before)
    k_h = slew_gain(fade.now.gains.k_h, target, counted, state.normal_force)
    gains = newest if k_h == newest.k_h else Gains(k_h, newest.integral_gain)
    return with_gains(fade, gains)
