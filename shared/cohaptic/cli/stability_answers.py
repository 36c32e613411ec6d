"""Compute the answers of `cohaptic stability`, as the fields of its JSON output.

`alone` judges one contact, `several` several contacts, and `room` several contacts with a delay for
each user (`--delays`) by the room's exact roots and by the theorem of science 3.8.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cohaptic.control.law import Law
from cohaptic.control.stability.lag_choice import (
    FRACTION,
    coupling_matrix,
    coupling_radius,
    lag_needed,
    margin,
)
from cohaptic.control.stability.room_roots import growth
from cohaptic.control.stability.several_contacts import (
    check_compliance,
    couple,
    largest_uniform_gains,
)
from cohaptic.control.stability.single_contact import (
    Floats,
    elastic_object,
    integral_is_stable,
    integral_model,
    lifted_radius,
    proportional_is_stable,
    proportional_model,
)
from cohaptic.control.stability.stable_set import stability_area
from cohaptic.errors import SettingError


# Above 60 lines with the docstring, which explains every argument.
def alone(
    law: Law,
    k_o: float,
    k_h: float,
    integral_gain: float,
    b_o: float,
    sim_period: float,
    haptic_period: float,
    delay: float,
) -> dict[str, Any]:
    """Judge whether one contact is stable, by the lifted system and the paper's closed condition.

    Args:
        law: Local model.
        k_o: Stiffness of the object [N/m].
        k_h: Gain K_h [N/m].
        integral_gain: Integral gain I [N/(m s)].
        b_o: Damping of the object divided by the simulation period, eq. (9) [N/m].
        sim_period: Simulation period N T [s].
        haptic_period: Haptic period T [s].
        delay: Network round trip beyond one simulation period [s].

    Returns:
        Fields of the JSON answer; `closed_condition` is None if no closed condition applies.

    Raises:
        SettingError: A value is outside its limits.
    """
    check_at_least(
        ("k_o", k_o, 1e-9),
        ("k_h", k_h, 0.0),
        ("integral_gain", integral_gain, 0.0),
        ("b_o", b_o, 0.0),
        ("haptic period", haptic_period, 1e-6),
        ("simulation period", sim_period, haptic_period),
        ("delay", delay, 0.0),
    )
    if integral_gain > 0.0 and not law.answers_own_dent:
        raise SettingError("integral_gain", integral_gain, f"left out: {law.value} has no integral")
    rate_ratio, samples = _in_samples(sim_period, delay, haptic_period)
    body = elastic_object(k_o, b_o)
    closed: bool | None = None
    if not law.answers_own_dent:
        # The surface is free of the client's own force: with the true compliance there is no loop.
        radius = 0.0
    elif law.model.integrates:
        local = integral_model(k_h, integral_gain, haptic_period)
        radius = lifted_radius(local, body, rate_ratio, samples)
        if samples == 0 and k_h > 0.0 and integral_gain > 0.0:
            period = rate_ratio * haptic_period
            closed = integral_is_stable(k_h, integral_gain, k_o, period, b_o)
    else:
        radius = lifted_radius(proportional_model(k_h), body, rate_ratio, samples)
        if samples == 0 or b_o == 0.0:
            closed = proportional_is_stable(k_h, k_o, b_o)
    return {
        "law": law.value,
        "stable": radius < 1.0,
        "spectral_radius": radius,
        "closed_condition": closed,
        "felt_stiffness": law.model.felt_stiffness(k_h, k_o),
        "rate_ratio": rate_ratio,
        "delay_samples": samples,
    }


def _in_samples(sim_period: float, delay: float, haptic_period: float) -> tuple[int, int]:
    """Return simulation period and delay in haptic samples; raise SettingError if too long."""
    rate_ratio = round(sim_period / haptic_period)
    samples = round(delay / haptic_period)
    if rate_ratio * haptic_period > 10.0 or samples > 10_000:
        raise SettingError("delay and periods", f"{samples} samples", "at most 10,000 samples")
    return rate_ratio, samples


def area_corners(
    k_o: float, b_o: float, sim_period: float, rate_ratio: int, delay: float
) -> list[list[float]]:
    """Return the corners of the stable set of gain K_h [N/m] and integral gain I [N/(m s)].

    The set is drawn as in Fig. 8. For a delay of whole simulation periods the function uses one
    haptic sample per period, which is quicker.

    Args:
        k_o: Stiffness of the object [N/m].
        b_o: Damping of the object divided by the simulation period, eq. (9) [N/m].
        sim_period: Simulation period N T [s].
        rate_ratio: Haptic samples per simulation period, N.
        delay: Network round trip beyond one simulation period [s].
    """
    periods = delay / sim_period
    whole = abs(periods - round(periods)) < 1e-6
    ratio = 1 if whole else rate_ratio
    samples = round(periods * ratio)
    polygon = stability_area(k_o, b_o, rate_ratio=ratio, delay_samples=samples, points=61)
    return [[k_h, int_ / sim_period] for k_h, int_ in polygon.tolist()]


def several(
    law: Law, C: Floats, k_h: Floats, integral_gain: float, sim_period: float, delay: float
) -> dict[str, Any]:
    """Judge whether several contacts are stable without and under any delay, and find safe gains.

    Args:
        law: Local model of all users.
        C: Compliance matrix of the contacts, shape (n, n) [m/N].
        k_h: Gains to be judged, shape (n,), or shape () for one gain of all users [N/m].
        integral_gain: Integral gain I of all users [N/(m s)].
        sim_period: Simulation period N T [s].
        delay: Network round trip, for the safe gains [s].

    Returns:
        Fields of the JSON answer.

    Raises:
        SettingError: A value is outside its limits.
    """
    gains = np.full(len(C), float(k_h)) if k_h.ndim == 0 and C.ndim else k_h
    check_at_least(("integral_gain", integral_gain, 0.0), ("delay", delay, 0.0))
    check_period(sim_period)
    judged = couple(
        C, gains, law, integral_gain=integral_gain, simulation_period=sim_period, delay=delay
    )
    any_delay = judged.rho_any_delay
    answer: dict[str, Any] = {
        "law": law.value,
        "stable_no_delay": judged.rho_no_delay < 1.0,
        "stable_any_delay": any_delay is not None and any_delay < 1.0,
        "rho_no_delay": judged.rho_no_delay,
        "rho_any_delay": any_delay,
        "safe_k_h": list(judged.safe_k_h),
        "safe_integral_gain": list(judged.safe_integral_gain),
        "largest_uniform_k_h": largest_uniform_gains(C, law).tolist(),
        "felt_stiffness": list(judged.felt_stiffness),
        "stiffness_loss": list(judged.stiffness_loss),
    }
    if judged.coupling is not None:
        answer |= {"coupling": judged.coupling, "lag_needed": judged.lag_needed}
    return answer


def check_at_least(*values: tuple[str, float, float]) -> None:
    """Raise SettingError for the first value that is not finite or is below its minimum.

    Args:
        *values: Name, value and minimum of each value.
    """
    for name, value, least in values:
        if not (math.isfinite(value) and value >= least):
            raise SettingError(name, value, f"a finite number of at least {least:g}")


def check_period(sim_period: float) -> None:
    """Raise SettingError unless the simulation period [s] is from 0.0001 to 10 s."""
    if not 1e-4 <= sim_period <= 10.0:
        raise SettingError("simulation period", f"{sim_period} s", "from 0.0001 to 10 s")


MAX_USERS = 64  # the largest room that a server allows (`ServerSettings.max_users`)
MAX_DELAY, MAX_LAG = 60.0, 600.0  # s; far beyond any room that can be touched


def room(
    law: Law, C: Floats, delays: Floats, k_h: Floats | None, lag: float | None, sim_period: float
) -> dict[str, Any]:
    """Judge whether a room of hands held still is stable at its users' loop delays (science 3.8).

    The answer is for a server that anticipates no forces (3.12); with anticipation, hands held
    still need no lag (3.13).

    Args:
        law: Law that does not answer its own dent; the other laws have no lag.
        C: Compliance matrix of the contacts, shape (n, n) with n at most 64 [m/N].
        delays: Loop delay T_i of each user, shape (n,), or () for all users [s].
        k_h: Gain K_i of each user, at most 1 / C_ii, shape (n,), or () for all users; None for
            1 / C_ii [N/m].
        lag: Lag tau of the room; None for the server's choice for hands held still [s].
        sim_period: Simulation period N T, over which the spectral radius is taken [s].

    Returns:
        Fields of the JSON answer. `spectral_radius` and `growth_rate` [1/s] are of these delays;
        `lag_needed` [s] and `margin` hold for all delays up to the longest. None is infinite.

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
        lag = needed / FRACTION if needed > 0.0 or m < 1.0 else sim_period
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
    """Return one value for each of n users; raise SettingError if one is outside its limits.

    Args:
        name: Name of the value, for the message.
        values: Values, shape (n,), or shape () for one value of all users.
        n: Number of users.
        limits: Minimum of all users, and maximum of each user, shape (n,); a value may exceed its
            maximum by rounding.
        unit: Unit, for the message.
        why: Reason for the maximum, appended to the message.
    """
    if values.shape not in ((), (n,)):
        limit = f"of shape ({n},), one of each user [{unit}]"
        raise SettingError(f"{name}", f"of shape {values.shape}", limit)
    low, high = limits
    full = np.broadcast_to(values, (n,)).astype(np.float64)
    for i, (value, largest) in enumerate(zip(full.tolist(), high.tolist(), strict=True)):
        if not low <= value <= largest * (1.0 + 1e-9):
            limit = f"from {low:g} to {largest:.6g} {unit}{why}"
            raise SettingError(f"{name} of user {i + 1}", f"{value:.6g} {unit}", limit)
    return full
