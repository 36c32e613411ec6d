"""Runs `cohaptic bench transparency`: from its options to tables, a file and a picture."""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace

from rich.console import Console

from cohaptic import __version__
from cohaptic.cli.network import injected
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
    of_roughness,
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
        links: Networks, each way.
        users: Numbers of users.
        presets: Names of simulated devices.
        hz: Ticks per second.
        models: Whether clients move models of the hands.
        hands: Mechanics of the hands, of which all hands of a cell have the same.
        together: Whether all hands touch at the same instant.
        late_ticks: Share of the server's ticks that come one or two periods late.
    """

    laws: tuple[Law, ...]
    links: tuple[LinkSettings, ...]
    users: tuple[int, ...]
    presets: tuple[str, ...]
    hz: float
    models: bool = True
    hands: tuple[Hand, ...] = (USUAL,)
    together: bool = False
    late_ticks: float = 0.0

    def __post_init__(self) -> None:
        for n in self.users:
            if not 2 <= n <= 16:
                raise SettingError("number of users", n, "from 2 to 16")
        if not 0.0 <= self.late_ticks <= 1.0:
            fraction = f"{100.0 * self.late_ticks:g} %"
            raise SettingError("share of late ticks", fraction, "from 0 to 100 %")
        for preset in self.presets:
            if preset not in ("rig", *PRESETS):
                raise SettingError("preset", repr(preset), f"one of: rig, {', '.join(PRESETS)}")
        ServerSettings(simulation_hz=self.hz)

    def cells(self) -> list[Cell]:
        """Return all combinations, each once."""
        every = itertools.product(self.laws, self.users, self.presets, self.hands, self.links)
        return [
            Cell(law, link, self.late_ticks, n, preset, hand, self.hz, self.models, self.together)
            for law, n, preset, hand, link in dict.fromkeys(every)
        ]


def links_of(
    networks: Sequence[str],
    delays_ms: Sequence[float],
    jitter_ms: float | None,
    loss: float | None,
    seed: int,
) -> tuple[LinkSettings, ...]:
    """Return the links that options describe: each network with each delay.

    Args:
        networks: Words for networks; if empty, a link without jitter and losses.
        delays_ms: Delays in place of the networks' own [ms]; without networks 0, 80 and 250 ms.
        jitter_ms, loss: Jitter [ms] and lost messages [%] in place of the networks'; None for
            theirs.
        seed: Seed of the draws.

    Raises:
        SettingError: A word is unknown, or a value is out of its limits.
    """
    delays: Sequence[float | None] = delays_ms or ([None] if networks else [0.0, 80.0, 250.0])
    links = [injected(n, ms, jitter_ms) for n in networks or [""] for ms in delays]
    lost = {} if loss is None else {"loss": 1e-2 * loss}
    return tuple(replace(link, seed=seed, **lost) for link in links)


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
            progress=lambda fraction: bar.update(task, completed=fraction),
        )  # fmt: skip
    for table in (of_others(rows), after_a_press(rows), of_roughness(rows), of_the_half(rows)):
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
