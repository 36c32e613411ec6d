"""The answer of `cohaptic stability --delays`: exact roots of a room, and the theorem's values."""

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
    """Judge whether a room of hands held still is stable at its own loop delays (science 3.8).

    The answer holds for forces that are not anticipated, as in a room where a user uses a law of
    the paper or a contact is steep; with anticipation, hands held still need no lag (3.13).

    Args:
        law: Law that does not answer its own dent; the other laws have no lag.
        C: Contact compliance, shape (n, n) with n at most 64 [m/N].
        delays: Loop delay T_i of each user, shape (n,), or () for all users [s].
        k_h: K_i, each at most 1 / C_ii, shape (n,), or () for all users; None for 1 / C_ii [N/m].
        lag: Lag tau of the room; None for the server's choice for hands held still [s].
        sim_period: N T, over which the spectral radius is taken [s].

    Returns:
        Fields of the JSON answer. `stable`, `spectral_radius` and `growth_rate` [1/s] are those of
        the exact roots at these delays; `coupling`, `lag_needed` [s] and `margin` are the
        theorem's, for all delays up to the longest. An infinite radius, rate or margin is None.

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
        # Without delays and with m >= 1 every lag above 0 is stable, but 0 is not: use one period.
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
    """Values of each of n users; raises SettingError for the first value out of its limits.

    Args:
        name: Name of the value, for the message.
        values: Values, shape (n,), or shape () for one value of all users.
        n: Number of users.
        limits: Minimum of all users, and maximum of each user, shape (n,), with room for rounding.
        unit: Unit, for the message.
        why: Reason for the maximum, appended to the message.
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
