"""One look for all figures: colours that everybody can tell apart, and no clutter."""

# pyright: reportUnknownMemberType=false
# (matplotlib's signatures leave their keywords open.)

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Okabe and Ito's palette.
PROBE = "#0072B2"
PROXY = "#D55E00"
THIRD = "#009E73"
FOURTH = "#CC79A7"
LIGHT = "#56B4E9"
GREY = "#6B7280"

STYLE: dict[Any, Any] = {
    "figure.dpi": 100,
    "savefig.dpi": 200,
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.labelsize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E5E7EB",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}


@contextmanager
def styled() -> Generator[None, None, None]:
    """Everything that is drawn and written inside has the common style."""
    with mpl.rc_context(STYLE):
        yield


def canvas(width: float = 6.4, height: float = 3.6) -> Figure:
    """An empty figure [inch]; without pyplot, so that no window system is ever asked for."""
    return Figure(figsize=(width, height), layout="constrained")


def name_line(axes: Axes, y: float, text: str, color: str) -> None:
    """Write a line's name to the right of the axes, where it hides nothing, at its last value."""
    axes.annotate(
        text,
        (1.0, y),
        xycoords=axes.get_yaxis_transform(),
        xytext=(5, 0),
        textcoords="offset points",
        color=color,
        fontsize=8,
        va="center",
        ha="left",
        annotation_clip=False,
    )
