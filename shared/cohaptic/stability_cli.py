"""`cohaptic stability`: whether gains are stable, and which are."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from cohaptic.control.coupling import couple, largest_uniform_gains
from cohaptic.control.law import Law
from cohaptic.control.stability import (
    elastic_object,
    integral_is_stable,
    integral_model,
    lifted_radius,
    proportional_is_stable,
    proportional_model,
)
from cohaptic.control.stability_area import stability_area
from cohaptic.errors import SettingError


def stability(
    law: Annotated[Law, typer.Option(help="Local model.")] = Law.PREDICTIVE,
    k_o: Annotated[float, typer.Option(help="Stiffness of the object at the contact, N/m.")] = 200,
    k_h: Annotated[
        str, typer.Option(help="Gain, N/m; with --compliance one for each contact, as JSON.")
    ] = "100",
    integral_gain: Annotated[float, typer.Option(help="I of the law's integral, N/(m s).")] = 0.0,
    b_o: Annotated[
        float, typer.Option(help="Damping over the simulation period, eq. (9), N/m.")
    ] = 0.0,
    sim_period: Annotated[float, typer.Option(help="Simulation period N T, s.")] = 1.0 / 60.0,
    haptic_period: Annotated[float, typer.Option(help="Haptic period T, s.")] = 0.001,
    delay: Annotated[
        float, typer.Option(help="Network round trip, on top of one simulation period, s.")
    ] = 0.0,
    compliance: Annotated[
        str | None, typer.Option(help="C of several contacts, m/N, as JSON rows.")
    ] = None,
    area: Annotated[
        bool, typer.Option("--area", help="Also give the stable set of K_h and I as a polygon.")
    ] = False,
    json_to: Annotated[
        str | None, typer.Option("--json", help="Write JSON to this file; - prints it.")
    ] = None,
) -> None:
    """Say whether a local model is stable against an object, alone or with others.

    Alone: the lifted system of the paper, with delay to the haptic sample, and the closed
    conditions where they apply. With --compliance: several contacts, without delay and under any
    delay, and the gains that are safe.
    """
    if compliance is not None:
        C, gains = _numbers("compliance", compliance), _numbers("k_h", k_h)
        answer = _several(law, C, gains, integral_gain, sim_period, delay)
    else:
        gain = _numbers("k_h", k_h)
        if gain.size != 1:
            raise SettingError("k_h", k_h, "one number, or --compliance with as many contacts")
        one = float(gain.reshape(-1)[0])
        answer = _alone(law, k_o, one, integral_gain, b_o, sim_period, haptic_period, delay)
        if area:
            answer["area"] = _area(k_o, b_o, sim_period, int(answer["rate_ratio"]), delay)
    text = json.dumps(answer, indent=2)
    if json_to == "-":
        typer.echo(text)
    elif json_to is not None:
        Path(json_to).write_text(text + "\n")
    else:
        _show(answer)


def _alone(
    law: Law,
    k_o: float,
    k_h: float,
    integral_gain: float,
    b_o: float,
    sim_period: float,
    haptic_period: float,
    delay: float,
) -> dict[str, Any]:
    """One contact."""
    for name, value, low in (
        ("k_o", k_o, 1e-9),
        ("k_h", k_h, 0.0),
        ("integral_gain", integral_gain, 0.0),
        ("b_o", b_o, 0.0),
        ("haptic period", haptic_period, 1e-6),
        ("simulation period", sim_period, haptic_period),
        ("delay", delay, 0.0),
    ):
        if not (math.isfinite(value) and value >= low):
            raise SettingError(name, value, f"a finite number of at least {low:g}")
    rate_ratio = round(sim_period / haptic_period)
    samples = round(delay / haptic_period)
    if rate_ratio * haptic_period > 10.0 or samples > 10_000:
        raise SettingError("delay and periods", f"{samples} samples", "at most 10,000 samples")
    body = elastic_object(k_o, b_o)
    closed: bool | None = None
    if law is Law.PREDICTIVE:
        # With the object's true compliance nothing of its own force is in what it presses on.
        radius = 0.0
    elif law is Law.PI:
        local = integral_model(k_h, integral_gain, haptic_period)
        radius = lifted_radius(local, body, rate_ratio, samples)
        if samples == 0 and k_h > 0.0 and integral_gain > 0.0:
            period = rate_ratio * haptic_period
            closed = integral_is_stable(k_h, integral_gain, k_o, period, b_o)
    else:
        radius = lifted_radius(proportional_model(k_h), body, rate_ratio, samples)
        if samples == 0 or b_o == 0.0:
            closed = proportional_is_stable(k_h, k_o, b_o)
    felt = {
        Law.PROPORTIONAL: k_h * k_o / (k_h + k_o),  # eq. (11)
        Law.PI: k_o,
        Law.PREDICTIVE: min(k_h, k_o),
    }[law]
    return {
        "law": law.value,
        "stable": radius < 1.0,
        "spectral_radius": radius,
        "closed_condition": closed,
        "felt_stiffness": felt,
        "rate_ratio": rate_ratio,
        "delay_samples": samples,
    }


def _area(
    k_o: float, b_o: float, sim_period: float, rate_ratio: int, delay: float
) -> list[list[float]]:
    """Corners (K_h [N/m], I [N/(m s)]) of the stable set, Fig. 8.

    Delays of whole periods need no haptic samples, and are quicker.
    """
    periods = delay / sim_period
    whole = abs(periods - round(periods)) < 1e-6
    ratio = 1 if whole else rate_ratio
    samples = round(periods * ratio)
    polygon = stability_area(k_o, b_o, rate_ratio=ratio, delay_samples=samples, points=61)
    return [[k_h, int_ / sim_period] for k_h, int_ in polygon.tolist()]


def _several(
    law: Law,
    C: np.ndarray,
    k_h: np.ndarray,
    integral_gain: float,
    sim_period: float,
    delay: float,
) -> dict[str, Any]:
    """Several contacts."""
    gains = np.full(len(C), float(k_h)) if k_h.ndim == 0 else k_h
    for name, value in (("integral_gain", integral_gain), ("delay", delay)):
        if not (math.isfinite(value) and value >= 0.0):
            raise SettingError(name, value, "a finite number of at least 0")
    if not 1e-4 <= sim_period <= 10.0:
        raise SettingError("simulation period", f"{sim_period} s", "from 0.0001 to 10 s")
    judged = couple(
        C, gains, law, integral_gain=integral_gain, simulation_period=sim_period, delay=delay
    )
    any_delay = judged.rho_any_delay
    return {
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


def _numbers(name: str, text: str) -> np.ndarray:
    """An array from JSON; raises SettingError with what came."""
    try:
        return np.array(json.loads(text), dtype=np.float64)
    except (ValueError, TypeError) as error:
        raise SettingError(
            name, repr(text), "numbers as JSON, such as 150 or [150, 120]"
        ) from error


def _show(answer: dict[str, Any]) -> None:
    """The answer for a person."""
    table = Table(show_header=False, box=None)
    for name, value in answer.items():
        if name == "area":
            value = f"{len(value) - 1} corners; --json writes them"
        table.add_row(name.replace("_", " "), _in_words(value))
    Console().print(table)


def _in_words(value: object) -> str:
    """One value of the answer."""
    if isinstance(value, list):
        return ", ".join(_in_words(part) for part in cast("list[object]", value))
    if isinstance(value, bool):
        return "yes" if value else "NO"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
