"""Viscous damping of a response, shared by linear and nonlinear bodies."""

from __future__ import annotations

import numpy as np

from cohaptic.errors import SettingError
from cohaptic_server.numeric import Floats


def check_damping(damping: float) -> None:
    """Refuse a B_o over K_o that is no damping, or so much that hands under delay sway for long."""
    if not 0.0 <= damping <= 2.0:
        raise SettingError("damping B_o / K_o", damping, "from 0 to 2 (relaxation in ticks)")


def lagged(loads: Floats, carried: Floats, damping: float) -> Floats:
    """What a viscous body carries in this tick, of loads and what it carried before, any shape."""
    return np.asarray((loads + damping * carried) / (1.0 + damping))
