"""The picture of `growth.py`: four costs over their sizes, each above its floor."""

# pyright: reportUnknownMemberType=false
# (matplotlib's signatures leave their keywords open.)

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

PANELS = {
    "users": ("a tick of the balloon", "users who slide", "ms", 1e3, "rows of C read once"),
    "mesh": ("a tick of a solid, four users", "tetrahedra", "ms", 1e3, "columns read once"),
    "preparation": ("preparing that solid", "tetrahedra", "s", 1.0, "factor written once"),
    "rate": ("the haptic loop", "periods a second", "% of a core", 100.0, "empty loop in C"),
}


def draw(points: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Draw all curves that have points.

    Args:
        points: Rows with `over` (a key of `PANELS`), `size`, `cost` and `floor`.
        path: A .png or .svg.
    """
    # They need matplotlib, which a table does not.
    from matplotlib.ticker import FuncFormatter, NullFormatter

    from cohaptic_experiments.plot_style import GREY, PROBE, canvas, styled

    with styled():
        figure = canvas(7.2, 5.0)
        for axes, (name, panel) in zip(figure.subplots(2, 2).flat, PANELS.items(), strict=True):
            title, along, unit, scale, floor = panel
            curve = [point for point in points if point["over"] == name]
            size = [point["size"] for point in curve]
            axes.loglog(size, [scale * p["cost"] for p in curve], "o-", color=PROBE, label="cost")
            axes.loglog(
                size, [scale * p["floor"] for p in curve], "--", color=GREY, label=f"floor: {floor}"
            )
            if unit == "ms":
                axes.axhline(1e3 / 60.0, color=GREY, linewidth=0.8)
                middle, above = (0.5, 1e3 / 60.0), axes.get_yaxis_transform()
                axes.text(*middle, "60 Hz", transform=above, va="bottom", fontsize=8, color=GREY)
            axes.set_xticks(size, [_short(value) for value in size], minor=False)
            axes.yaxis.set_major_formatter(FuncFormatter(_plain))
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_minor_formatter(NullFormatter())
            axes.set(title=title, xlabel=along, ylabel=unit)
            axes.legend()
        figure.savefig(path)


def _short(count: float) -> str:
    """A count in at most four signs, such as 550k."""
    return f"{count:.0f}" if count < 1e4 else f"{count / 1e3:.0f}k"


def _plain(value: float, _: object) -> str:
    """A number without an exponent."""
    return f"{value:g}"
