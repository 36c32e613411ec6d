"""The answer of `cohaptic stability --delays`: the exact roots of a room, beside the theorem."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cohaptic.cli.stability_answers import check_period
from cohaptic.control.law import Law
from cohaptic.control.stability.lag_choice import (
    SHARE,
    coupling_matrix,
    coupling_radius,
    lag_needed,
    margin,
)
from cohaptic.control.stability.room_roots import growth
from cohaptic.control.stability.several_contacts import check_compliance
from cohaptic.control.stability.single_contact import Floats
from cohaptic.errors import SettingError

MAX_USERS = 64  # the largest room that a server allows (`ServerSettings.max_users`)
MAX_DELAY, MAX_LAG = 60.0, 600.0  # s; far beyond any room that can be touched


def room(
    law: Law, C: Floats, delays: Floats, k_h: Floats | None, lag: float | None, sim_period: float
) -> dict[str, Any]:
    """Whether a room of hands held still is stable at its own loop delays (science 3.8).

    Without anticipation, as where somebody uses a law of the paper or a contact is steep; with it
    hands held still need no lag (3.13).

    Args:
        law: A law that does not answer its own dent: the others have no lag.
        C: Contact compliance, shape (n, n) with n at most 64 [m/N].
        delays: Loop delay T_i of each user, shape (n,), or () for all [s].
        k_h: K_i, each at most 1 / C_ii, shape (n,), or () for all; None for 1 / C_ii [N/m].
        lag: tau; None for the server's choice for hands held still [s].
        sim_period: N T, over which the spectral radius is taken [s].

    Returns:
        `stable`, `spectral_radius` and `growth_rate` [1/s] are those of the exact roots at these
        delays; `coupling`, `lag_needed` [s] and `margin` the theorem's, for all delays up to the
        longest. A radius, rate or margin without bound is None.

    Raises:
        SettingError: A value is outside its limits, or outside the theorem.
    """
    if law.answers_own_dent:
        lagged = " or ".join(each.value for each in Law if not each.answers_own_dent)
        limit = f"{lagged} with --delays: no other has a lag"
        raise SettingError("law", law.value, limit)
    if C.ndim == 2 and len(C) > MAX_USERS:
        raise SettingError("compliance", f"that of {len(C)} users", f"of at most {MAX_USERS}")
    check_compliance(C)
    check_period(sim_period)
    n, own = len(C), np.diag(C)
    each("own compliance", own, n, (1e-12, np.full(n, 1e6)), "m/N")
    T = each("loop delay", delays, n, (0.0, np.full(n, MAX_DELAY)), "s")
    K = 1.0 / own
    if k_h is not None:
        why = ", its 1 / C_ii: above it the room is outside the theorem of science 3.8"
        K = each("k_h", k_h, n, (0.0, K), "N/m", why)
    S = coupling_matrix(C, [np.array([[k]]) for k in K.tolist()])
    m, longest = coupling_radius(S), float(T.max())
    needed = lag_needed(m, longest)
    if lag is None:
        # Without any delay every positive lag is stable for m >= 1, but not 0: take one period.
        lag = needed / SHARE if needed > 0.0 or m < 1.0 else sim_period
    elif not 0.0 <= lag <= MAX_LAG:
        raise SettingError("lag", f"{lag:g} s", f"from 0 to {MAX_LAG:g} s")
    rate, edge = growth(S, T, lag), margin(m, longest, lag)
    radius = math.exp(rate * sim_period) if rate * sim_period < 700.0 else math.inf
    return {
        "law": law.value,
        "stable": radius < 1.0,
        "spectral_radius": radius if math.isfinite(radius) else None,
        "growth_rate": rate if math.isfinite(rate) else None,
        "coupling": m,
        "lag": lag,
        "lag_needed": needed,
        "margin": edge if math.isfinite(edge) else None,
        "k_h": K.tolist(),
    }


def each(
    name: str, values: Floats, n: int, limits: tuple[float, Floats], unit: str, why: str = ""
) -> Floats:
    """A value for each of n users, or SettingError with the first that is out of its limits.

    Args:
        name: Name of the value, for the message.
        values: Shape (n,), or () for the same of everybody.
        n: How many users there are.
        limits: The least value, and the largest of each user, shape (n,), but for rounding.
        unit: For the message.
        why: Reason for the largest value, appended to the message.
    """
    if values.shape not in ((), (n,)):
        limit = f"of shape ({n},), one of each user [{unit}]"
        raise SettingError(f"{name}", f"of shape {values.shape}", limit)
    low, high = limits
    full = np.broadcast_to(values, (n,)).astype(np.float64)
    for i, (value, most) in enumerate(zip(full.tolist(), high.tolist(), strict=True)):
        if not low <= value <= most * (1.0 + 1e-9):
            limit = f"from {low:g} to {most:.6g} {unit}{why}"
            raise SettingError(f"{name} of user {i + 1}", f"{value:.6g} {unit}", limit)
    return full
