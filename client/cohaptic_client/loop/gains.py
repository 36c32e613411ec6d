"""The gains of a patch: as the server sent them, and at the present position of the probe."""

from __future__ import annotations

from typing import Final

from cohaptic.control.geometry import Sight
from cohaptic.control.laws.model import Gains
from cohaptic.protocol.patch import MIN_COMPLIANCE, Patch
from cohaptic_client.loop.state import LoopSettings

# Largest factor by which C_ii differs within one patch; a larger one is an error of the patch. Over
# the whole balloon it varies by half. Reasoned, not measured.
MAX_CHANGE: Final = 2.0
# Least K_h C_ii for which K_h counts as the object's stiffness 1 / C_ii: two numbers of 32 bits,
# each rounded by 6e-8 at most.
_AS_STIFF: Final = 1.0 - 1e-5


def gains_as_sent(patch: Patch, settings: LoopSettings) -> Gains:
    """Return the gains in a patch, with K_h no larger than the device renders stably."""
    return Gains(min(patch.k_h, settings.max_stiffness), patch.integral_gain)


def gains_under(patch: Patch, sight: Sight, settings: LoopSettings) -> Gains:
    """Return the gains of a patch at the present position of the probe.

    The server chooses gains in proportion to 1 / C_ii, the object's stiffness at the contact. The
    compliance C_ii varies over a body: on the balloon by half from the equator to the pole. A mesh
    patch has C_ii under the probe; other patches have C_ii at their own contact only.

    Args:
        sight: Surface sample at the probe.
    """
    if not settings.follow:
        return gains_as_sent(patch, settings)
    least, largest = patch.c_ii / MAX_CHANGE, patch.c_ii * MAX_CHANGE
    c_ii = max(MIN_COMPLIANCE, least, min(largest, sight.c_ii))
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
