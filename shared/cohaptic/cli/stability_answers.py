"""Answers of `cohaptic stability` for one contact, and for several contacts without delays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cohaptic.control.law import Law, felt_stiffness
from cohaptic.control.stability.several_contacts import couple, largest_uniform_gains
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
    """Judge one contact by the lifted system, and by the paper's closed condition if one applies.

    Args:
        law: Local model.
        k_o: Stiffness of the object [N/m].
        k_h: Gain K_h [N/m].
        integral_gain: Integral gain I [N/(m s)].
        b_o: Damping of the object over the simulation period, eq. (9) [N/m].
        sim_period: N T [s].
        haptic_period: T [s].
        delay: Network round trip beyond one simulation period [s].

    Returns:
        Fields of the JSON answer.

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
    elif law.integrates:
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
        "felt_stiffness": felt_stiffness(law, k_h, k_o),
        "rate_ratio": rate_ratio,
        "delay_samples": samples,
    }


def _in_samples(sim_period: float, delay: float, haptic_period: float) -> tuple[int, int]:
    """Simulation period and delay in haptic samples; raises SettingError if one is too long."""
    rate_ratio = round(sim_period / haptic_period)
    samples = round(delay / haptic_period)
    if rate_ratio * haptic_period > 10.0 or samples > 10_000:
        raise SettingError("delay and periods", f"{samples} samples", "at most 10,000 samples")
    return rate_ratio, samples


def area_corners(
    k_o: float, b_o: float, sim_period: float, rate_ratio: int, delay: float
) -> list[list[float]]:
    """Corners (K_h [N/m], I [N/(m s)]) of the stable set, as in Fig. 8.

    For a delay of whole simulation periods one haptic sample per period suffices and is quicker.
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
    """Judge several contacts without delay and under any delay, and give safe gains.

    Args:
        law: Local model of all users.
        C: Contact compliance, shape (n, n) [m/N].
        k_h: Gains to be judged, shape (n,), or shape () for one gain of all users [N/m].
        integral_gain: I of all users [N/(m s)].
        sim_period: N T [s].
        delay: Network round trip, for the safe gains [s].

    Returns:
        The fields of the JSON answer.

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
    """Raise SettingError at the first value that is not finite or is below its minimum.

    Args:
        *values: Name, value and minimum of each.
    """
    for name, value, least in values:
        if not (math.isfinite(value) and value >= least):
            raise SettingError(name, value, f"a finite number of at least {least:g}")


def check_period(sim_period: float) -> None:
    """Raise SettingError unless `sim_period` [s] is in the range of simulation periods."""
    if not 1e-4 <= sim_period <= 10.0:
        raise SettingError("simulation period", f"{sim_period} s", "from 0.0001 to 10 s")
