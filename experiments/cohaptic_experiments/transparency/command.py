"""Runs `cohaptic bench transparency`: from its options to tables, a file and a picture."""

from __future__ import annotations

import itertools
import json
from dataclasses import dataclass

from rich.console import Console

from cohaptic import __version__
from cohaptic.cli.output import Output
from cohaptic.control.law import Law
from cohaptic.errors import SettingError
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.hand import Hand
from cohaptic_client.devices.simulated import PRESETS
from cohaptic_experiments.catalogue import extra_libraries
from cohaptic_experiments.report import progress_bar
from cohaptic_experiments.transparency.cells import Cell, Row, as_json, measure_all
from cohaptic_experiments.transparency.setting import USUAL
from cohaptic_experiments.transparency.shown import (
    after_a_press,
    of_others,
    of_the_half,
    picture,
)
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.settings import ServerSettings


@dataclass(frozen=True, slots=True)
class Grid:
    """Combinations to be measured.

    Args:
        laws: Laws.
        delays_ms: Delays, each way [ms].
        users: Numbers of users.
        presets: Names of simulated devices.
        hz: Ticks per second.
        models: Whether clients move models of the hands.
        hands: Mechanics of the hands, of which all hands of a cell have the same.
        together: Whether all hands touch at the same instant.
    """

    laws: tuple[Law, ...]
    delays_ms: tuple[float, ...]
    users: tuple[int, ...]
    presets: tuple[str, ...]
    hz: float
    models: bool = True
    hands: tuple[Hand, ...] = (USUAL,)
    together: bool = False

    def __post_init__(self) -> None:
        for n in self.users:
            if not 2 <= n <= 16:
                raise SettingError("number of users", n, "from 2 to 16")
        for delay in self.delays_ms:
            LinkSettings(1e-3 * delay)
        for preset in self.presets:
            if preset not in ("rig", *PRESETS):
                raise SettingError("preset", repr(preset), f"one of: rig, {', '.join(PRESETS)}")
        ServerSettings(simulation_hz=self.hz)

    def cells(self) -> list[Cell]:
        """Return all combinations, each once."""
        every = itertools.product(self.laws, self.users, self.presets, self.hands, self.delays_ms)
        return [
            Cell(law, 1e-3 * ms, n, preset, hand, self.hz, self.models, self.together)
            for law, n, preset, hand, ms in dict.fromkeys(every)
        ]


def read_hand(text: str) -> Hand:
    """Read the mechanics of a hand, mass [kg], damping [N s/m] and stiffness [N/m].

    Raises:
        SettingError: It is not three numbers, or one of them is out of its limits.
    """
    try:
        mass, damping, stiffness = map(float, text.split(","))
    except ValueError:
        raise SettingError("hand", repr(text), "three numbers, as 0.15,8,400") from None
    return Hand(mass, damping, stiffness)


def run(grid: Grid, *, budget: bool, json_file: Output | None, picture_file: Output | None) -> None:
    """Measure a grid, and show, write and draw the results."""
    body, console = Balloon(), Console()
    with progress_bar() as bar:
        task = bar.add_task("transparency", total=1.0)
        rows = measure_all(
            body, grid.cells(), budget=budget,
            progress=lambda share: bar.update(task, completed=share),
        )  # fmt: skip
    for table in (of_others(rows), after_a_press(rows), of_the_half(rows)):
        if table is not None:
            console.print(table)
    if json_file is not None:
        content = {"version": __version__, "rows": [as_json(r) for r in rows]}
        json_file.write(json.dumps(content, indent=2, allow_nan=False) + "\n")
    if picture_file is not None:
        _draw(rows, picture_file)


def _draw(rows: list[Row], file: Output) -> None:
    with extra_libraries():
        from cohaptic_experiments.plot_style import styled

        with styled():
            drawn = picture(rows)
            file.write_by(lambda png: drawn.savefig(png, format="png"))  # pyright: ignore[reportUnknownMemberType]
