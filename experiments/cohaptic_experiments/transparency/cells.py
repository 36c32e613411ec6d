"""Rows of the table of transparency: one law, delay, number of users, device and body each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from cohaptic.control.law import Law
from cohaptic.simulated.delay_line import AT_ONCE, LinkSettings
from cohaptic.simulated.hand import Hand
from cohaptic.simulated.networks import words_for
from cohaptic_client.devices.simulated import INFO, PRESETS
from cohaptic_experiments.transparency.budget import Budget, measure_budget
from cohaptic_experiments.transparency.frequency import (
    Responses,
    Transparency,
    measure,
    true_responses,
)
from cohaptic_experiments.transparency.press import (
    Delayed,
    Press,
    delayed,
    felt_presses,
    true_presses,
)
from cohaptic_experiments.transparency.product import Variant
from cohaptic_experiments.transparency.roughness import (
    Roughness,
    measure_roughness,
    true_sway,
)
from cohaptic_experiments.transparency.setting import USUAL, Setting
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats


@dataclass(frozen=True, slots=True)
class Cell:
    """One combination that is measured.

    Args:
        law: Law of every user.
        link: Network of every user, each way.
        late_ticks: Share of the server's ticks that come one or two periods late.
        users: Number of users.
        preset: Name of the simulated device of every user; "rig" for the usual one, which may
            render 8 N s/m of damping. The hand that sways over frequency is always on a rig.
        hand: Mechanics of the hands.
        hz: Ticks per second.
        models: Whether clients move models of the hands.
        together: Whether all hands touch at the same instant.
    """

    law: Law = Law.PREDICTIVE
    link: LinkSettings = AT_ONCE
    late_ticks: float = 0.0
    users: int = 2
    preset: str = "rig"
    hand: Hand = USUAL
    hz: float = 60.0
    models: bool = True
    together: bool = False


@dataclass(frozen=True, eq=False)
class Row:
    """Results of one cell.

    Args:
        cell: The combination.
        transparency: Ratios over frequency.
        lag: Lag of the room [s].
        press: Delays of the press of the first hand, for each other hand.
        roughness: How rough the sway of the first hand is felt by each other hand.
        budget: Parts of the delay of the second hand; None if it was not measured.
    """

    cell: Cell
    transparency: Transparency
    lag: float
    press: Sequence[Delayed]
    roughness: Sequence[Roughness]
    budget: Budget | None

    @property
    def latest(self) -> Delayed:
        """Press as the hand feels it that is the last to have felt most of it."""
        return max(self.press, key=lambda p: math.inf if math.isnan(p.late.limit) else p.late.limit)


class Bench:
    """Measures cells on one body; the truth of equal hands is computed once.

    Args:
        body: Touched body.
    """

    def __init__(self, body: Body) -> None:
        self._body = body
        self._responses = cache(self._true_responses)
        self._presses = cache(self._true_presses)
        self._sways = cache(self._true_sway)

    def measure(self, cell: Cell, *, budget: bool = False) -> Row:
        """Measure one cell, with the parts of its delay if `budget` is true."""
        setting, variant = self._setting(cell), Variant(cell.law, cell.hz, models=cell.models)
        truth = self._responses(cell.users, cell.preset, cell.hand)
        true = self._presses(cell.users, cell.preset, cell.hand)
        product = setting.product(variant)
        over_frequency = measure(setting, product, truth)
        felt = felt_presses(setting, lambda: setting.product(variant))
        press = [delayed(a, b) for a, b in zip(felt, true, strict=True)]
        parts = measure_budget(setting, variant, felt[0]) if budget else None
        true_force = self._sways(replace(cell, law=Law.PREDICTIVE, models=True))
        rough = measure_roughness(setting, lambda: setting.product(variant), true_force)
        return Row(cell, over_frequency, product.lag, press, rough, parts)

    def _setting(self, cell: Cell) -> Setting:
        info = INFO if cell.preset == "rig" else PRESETS[cell.preset]
        setting = Setting(self._body, cell.users, cell.hand, info, cell.link, cell.late_ticks)
        return replace(setting, apart=0.0) if cell.together else setting

    def _true_responses(self, users: int, preset: str, hand: Hand) -> Responses:
        return true_responses(self._setting(Cell(users=users, preset=preset, hand=hand)))

    def _true_presses(self, users: int, preset: str, hand: Hand) -> list[Press]:
        return true_presses(self._setting(Cell(users=users, preset=preset, hand=hand)))

    def _true_sway(self, cell: Cell) -> Floats:
        return true_sway(self._setting(cell))


def measure_all(
    body: Body, cells: Sequence[Cell], *, budget: bool, progress: Callable[[float], None]
) -> list[Row]:
    """Measure cells one after the other; `progress` is called with the share that is done."""
    bench, rows = Bench(body), list[Row]()
    for k, cell in enumerate(cells):
        progress(k / len(cells))
        rows.append(bench.measure(cell, budget=budget))
    progress(1.0)
    return rows


def as_json(row: Row) -> dict[str, Any]:
    """Return the results of a cell as JSON can hold them; NaN and infinite numbers become None."""
    found, cell = row.transparency, row.cell
    return {
        "law": cell.law.value,
        "delay_ms": 1e3 * cell.link.delay,
        "network": words_for(cell.link),
        "late_ticks": cell.late_ticks,
        "users": cell.users,
        "preset": cell.preset,
        "hand": asdict(cell.hand),
        "simulation_hz": cell.hz,
        "models": cell.models,
        "together": cell.together,
        "lag_ms": 1e3 * row.lag,
        "frequencies_hz": _numbers(found.frequencies),
        "others": _numbers(found.weakest),
        "others_delay_ms": _numbers(1e3 * found.delays),
        "own": _numbers(np.abs(found.own)),
        "own_phase_deg": _numbers(np.degrees(np.angle(found.own))),
        "bandwidth_hz": _number(found.bandwidth),
        "largest": _number(found.strongest),
        "explained": _number(found.explained_variance),
        "press": [
            {
                **{f"{name}_ms": _number(1e3 * t) for name, t in press.late._asdict().items()},
                "settled_ms": _number(1e3 * press.settled),
                "change_n": _number(press.change),
                "true_change_n": _number(press.true_change),
            }
            for press in row.press
        ],
        "roughness": [
            {name: _number(value) for name, value in asdict(rough).items()}
            for rough in row.roughness
        ],
        "budget_ms": None
        if row.budget is None
        else {name: _number(1e3 * value) for name, value in asdict(row.budget).items()},
    }


def _numbers(values: Floats) -> list[float | None]:
    return [_number(value) for value in values.tolist()]


def _number(value: float) -> float | None:
    return round(value, 6) if math.isfinite(value) else None
