"""Describe the answers of `cohaptic stability` for people: each value in words, with its unit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, cast

# Description, unit and factor from SI to that unit, for each key of the JSON answer.
WORDS: Final = {
    "law": ("control law", "", 1.0),
    "stable": ("stable", "", 1.0),
    "stable_no_delay": ("stable without delay", "", 1.0),
    "stable_any_delay": ("stable at any delay", "", 1.0),
    "spectral_radius": ("spectral radius (stable below 1)", "", 1.0),
    "rho_no_delay": ("spectral radius without delay", "", 1.0),
    "rho_any_delay": ("its bound for any delay", "", 1.0),
    "closed_condition": ("the paper's condition holds", "", 1.0),
    "growth_rate": ("growth of the fastest motion", "1/s", 1.0),
    "felt_stiffness": ("stiffness felt at rest", "N/m", 1.0),
    "stiffness_loss": ("share of the stiffness lost", "%", 100.0),
    "k_h": ("gain K_h of each user", "N/m", 1.0),
    "safe_k_h": ("safe K_h of each contact", "N/m", 1.0),
    "safe_integral_gain": ("safe I of each contact", "N/(m s)", 1.0),
    "largest_uniform_k_h": ("largest K_h if all have the same", "N/m", 1.0),
    "coupling": ("coupling of the hands (a lag from 1 on)", "", 1.0),
    "lag": ("lag of the room", "ms", 1e3),
    "lag_needed": ("lag that the theorem asks for", "ms", 1e3),
    "margin": ("margin of the room (stable above 1)", "", 1.0),
    "rate_ratio": ("haptic samples in a simulation period", "", 1.0),
    "delay_samples": ("haptic samples of delay", "", 1.0),
    "area": ("corners of the stable K_h and I", "", 1.0),
}


def in_words(answer: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield a description and a text with unit for each value of an answer.

    Args:
        answer: Fields of the JSON answer; `closed_condition` is omitted if it is None.
    """
    for key, value in answer.items():
        if key == "closed_condition" and value is None:
            continue
        words, unit, scale = WORDS[key]
        if key == "area":
            yield words, f"{len(value) - 1}; --json writes them"
            continue
        text = _text(value, scale)
        yield words, f"{text} {unit}" if unit and value is not None else text


def _text(value: object, scale: float) -> str:
    """Return one value times `scale` as text, or several values with commas between them."""
    if isinstance(value, list):
        return ", ".join(_text(part, scale) for part in cast("list[object]", value))
    if isinstance(value, bool):
        return "yes" if value else "NO"
    if value is None:
        return "without bound"
    return f"{scale * value:.4g}" if isinstance(value, int | float) else str(value)
