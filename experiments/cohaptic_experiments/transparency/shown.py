"""The results of transparency as tables on the terminal, and as a picture."""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group
from rich.table import Table
from rich.text import Text

from cohaptic.control.law import Law
from cohaptic.simulated.delay_line import AT_ONCE
from cohaptic.simulated.networks import NETWORKS
from cohaptic_experiments.transparency.cells import Cell, Row
from cohaptic_experiments.transparency.frequency import Transparency
from cohaptic_experiments.transparency.setting import USUAL
from cohaptic_server.numeric import Floats

if TYPE_CHECKING:
    from matplotlib.figure import Figure


LINEAR = 0.9  # least share of the variance that sines explain where their ratios are shown
_SHOWN = (0.1, 0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 20.0)  # Hz; what a terminal has room for


def over_frequency(rows: Sequence[Row], title: str, values: Callable[[Transparency], Floats],
                   form: str) -> Table:  # fmt: skip
    """Return a table of one value of each row over frequency.

    Args:
        rows: Rows.
        title: Title of the table.
        values: Values over the frequencies of a row.
        form: Format of a value.
    """
    table = _table(title, "Hz", *(f"{f:g}" for f in _SHOWN))
    for row in rows:
        found = row.transparency
        at = np.searchsorted(found.frequencies, _SHOWN)
        if not found.explained_variance >= LINEAR:  # NaN too
            table.add_row(name(row.cell), *["-"] * len(_SHOWN))
            continue
        table.add_row(name(row.cell), *(f"{v:{form}}" for v in values(found)[at].tolist()))
    return table


def of_others(rows: Sequence[Row]) -> Group:
    """Return tables of the others over frequency: amplitude and delay; of the own object as well.

    All are divided by the truth, so that 1 is right.
    """
    limits = _table("from -3 dB on, and the largest amplitude at any frequency", "", "-3 dB", "max")
    for row in rows:
        found = row.transparency
        if found.explained_variance >= LINEAR:
            limits.add_row(name(row.cell), _hertz(found.bandwidth), f"{found.strongest:.2f}")
    felt = "what one hand feels of another, over the truth (-: not linear)"
    own = "one's own object beside the others, over the truth"
    return Group(
        over_frequency(rows, felt, lambda found: found.weakest, ".2f"),
        limits,
        over_frequency(
            rows, "its phase as a delay, in ms", lambda found: 1e3 * found.delays, ".0f"
        ),
        over_frequency(rows, own, lambda found: np.abs(found.own), ".2f"),
    )


def after_a_press(rows: Sequence[Row]) -> Table:
    """Return a table of the delays of a press, for the hand that feels it last."""
    title = "felt of a press later than without a network, in ms; settled: after the press"
    table = _table(title, "", "10 %", "half", "90 %", "settled", "both ways", "lag")
    for row in rows:
        last, ways = row.latest, 2.0 * row.cell.link.delay
        times = (*last.late, last.settled, ways, row.lag)
        table.add_row(name(row.cell), *map(_milliseconds, times))
    return table


def of_roughness(rows: Sequence[Row]) -> Table:
    """Return a table of what the network adds to a sway as the roughest other hand feels it."""
    title = (
        "swing of the force on a resting hand while another sways at 1 Hz [mN],"
        "\nthat of the truth, and what is above 12 Hz; path, of the true one; lateness"
        "\nand its range [ms]; largest change within 20 ms at rest [mN]"
    )
    table = _table(title, "", "swing", "true", "fast", "path", "late", "range", "rest")
    for row in rows:
        worst = max(row.roughness, key=lambda rough: rough.fast)
        table.add_row(
            name(row.cell),
            f"{1e3 * worst.swing:.0f}",
            f"{1e3 * worst.true_swing:.0f}",
            f"{1e3 * worst.fast:.0f}",
            f"{worst.path:.2f}",
            _milliseconds(worst.late),
            _milliseconds(worst.offset_range),
            f"{1e3 * max(rough.at_rest for rough in row.roughness):.0f}",
        )
    return table


def of_the_half(rows: Sequence[Row]) -> Table | None:
    """Return a table of the parts of the delay of the second hand; None if none was measured."""
    title = "parts of the time until half of a press is felt, in ms"
    table = _table(title, "", "ways", "hand", "limits", "layer", "lag", "ticks", "rest", "sum")
    for row in rows:
        if (parts := row.budget) is not None:
            values = (
                parts.ways, parts.hand_and_body, parts.force_limit, parts.layer, parts.lag,
                parts.ticks, parts.rest, parts.whole,
            )  # fmt: skip
            table.add_row(name(row.cell), *map(_milliseconds, values))
    return table if table.row_count else None


def _table(title: str, first: str, *columns: str) -> Table:
    table = Table(title=Text(title), title_justify="left", box=None, pad_edge=False)
    table.add_column(first)  # which wraps where there is little room, and no number is cut
    for column in columns:
        table.add_column(column, justify="right", no_wrap=True)
    return table


def name(cell: Cell) -> str:
    """Return the name of a cell: law, delay, users, and what is not usual."""
    words = [_network(cell), f"{cell.users} hands"]
    if cell.law != Law.PREDICTIVE:  # a terminal has room for little
        words.insert(0, cell.law.value)
    if cell.preset != "rig":
        words.append(cell.preset)
    if cell.hand != USUAL:
        words.append(
            f"{cell.hand.mass:g} kg {cell.hand.damping:g} N s/m {cell.hand.stiffness:g} N/m"
        )
    if cell.together:
        words.append("together")
    return ", ".join(words)


def _network(cell: Cell) -> str:
    link = replace(cell.link, seed=0)
    names = {known.link: name for name, known in NETWORKS.items()}
    if not (words := names.get(link, "")):
        jitter = f"+{1e3 * link.jitter:g}" if link.jitter else ""
        words = f"{1e3 * link.delay:g}{jitter} ms"
        words += f" {100.0 * link.loss:g}% lost" if link.loss else ""
        words += " and more" if replace(link, delay=0.0, jitter=0.0, loss=0.0) != AT_ONCE else ""
    return words + (f" {100.0 * cell.late_ticks:g}% late" if cell.late_ticks else "")


def picture(rows: Sequence[Row]) -> Figure:
    """Draw amplitude and delay of the others, and the own object; of rows that are linear."""
    from cohaptic_experiments.plot_style import FOURTH, GREY, LIGHT, PROBE, PROXY, THIRD, canvas

    colors = (PROBE, PROXY, THIRD, FOURTH, LIGHT, GREY)
    looks = {Law.PREDICTIVE: "-", Law.PI: ":", Law.PROPORTIONAL: "--"}
    figure = canvas(7.2, 3.4)
    left, middle, right = figure.subplots(1, 3)
    linear = [row for row in rows if row.transparency.explained_variance >= LINEAR]
    for k, row in enumerate(linear):
        found = row.transparency
        style = {"color": colors[k % len(colors)], "linestyle": looks[row.cell.law]}
        left.plot(found.frequencies, found.weakest, label=name(row.cell), **style)
        middle.plot(found.frequencies, 1e3 * found.delays, **style)
        right.plot(found.frequencies, np.abs(found.own), **style)
    left.axhline(math.sqrt(0.5), color=GREY, linewidth=0.8, linestyle="--")
    left.set_title("felt of another / truth")
    middle.set_title("its phase as a delay [ms]")
    right.set_title("own stiffness / truth")
    for axes in (left, middle, right):
        axes.set_xscale("log")
        axes.set_xticks([0.1, 1.0, 10.0], ["0.1", "1", "10"])
        axes.set_xlabel("frequency [Hz]")
        axes.set_ylim(bottom=0.0)
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def _milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.0f}" if math.isfinite(seconds) else "never"


def _hertz(frequency: float) -> str:
    return f"{frequency:.2g} Hz" if math.isfinite(frequency) else "none"
