"""Viscous damping of a response, shared by linear and nonlinear bodies."""

from __future__ import annotations

import numpy as np

from cohaptic.errors import SettingError
from cohaptic_server.numeric import Floats


def check_damping(damping: float) -> None:
    """Refuse a ratio B_o / K_o that is negative, or so large that hands under delay sway for long.

    Raises:
        SettingError: The ratio is outside of 0 to 2.
    """
    if not 0.0 <= damping <= 2.0:
        raise SettingError("damping B_o / K_o", damping, "from 0 to 2 (relaxation in ticks)")


def lagged(applied: Floats, carried: Floats, damping: float) -> Floats:
    """Forces that the elastic part of a Kelvin-Voigt body carries at the end of a tick [N].

    Args:
        applied: Forces applied in this tick, any shape [N].
        carried: Forces that the elastic part carried before the tick, of the same shape [N].
        damping: Ratio B_o / K_o of eq. (9).
    """
    return np.asarray((applied + damping * carried) / (1.0 + damping))
