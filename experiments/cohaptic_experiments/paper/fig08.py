"""Fig. 8: the stable set of (K_h, I N T), in closed form, by lifting, and on the real session.

Beside the paper's triangle, eq. (15): the sets with damping, eq. (16), and with 1, 2 and 4
simulation periods of delay (science 3.1). Points on either side of the edge are then pressed.

Our server answers at once where the paper's simulation computes for a period, which makes another
set of the same form (`area_trials.edges`); the paper's is had over a network of that delay.
"""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from cohaptic.control.stability.stable_set import closed_edges, lifted_edges
from cohaptic_experiments.outcome import (
    Check,
    Options,
    Outcome,
    Progress,
    Table,
    at_least,
    at_most,
    part,
)
from cohaptic_experiments.paper.area_trials import (
    AT_ONCE,
    K_O,
    MARGIN,
    Trial,
    edges,
    try_both_sides,
)
from cohaptic_experiments.plot_style import FOURTH, GREY, LIGHT, PROBE, PROXY, THIRD, canvas
from cohaptic_server.numeric import Floats

NAME = "fig08"
TITLE = "stability area of K_h and I N T: eq. (15), lifting, delay, damping, and trials"
B_O = 0.25 * K_O
RATE_RATIO = 50
DELAYS = (1, 2, 4)  # simulation periods beyond the paper's one


@dataclass(frozen=True, eq=False)
class Curve:
    """The edge of a stable set.

    Args:
        label: For people.
        color: In the figure.
        k_h: Shape (n,) [N/m].
        low: Least stable I N T, nan where none is, shape (n,) [N/m].
        high: Largest, shape (n,) [N/m].
    """

    label: str
    color: str
    k_h: Floats
    low: Floats
    high: Floats


def run(options: Options, progress: Progress) -> Outcome:
    """Edges, then trials."""
    # Evenly, and close to the corners.
    corners = [0.999, 1.001, 1.499, 1.501, 2.999, 3.999]
    k_h = K_O * np.sort([*np.linspace(0.001, 3.9, 9 if options.quick else 41), *corners])
    near_k_o = K_O * np.linspace(0.001, 1.4, 15 if options.quick else 141)
    curves: list[Curve] = []
    apart = 0.0
    for b_o, label, color in ((0.0, "eq. (15)", PROBE), (B_O, "eq. (16), $B_o = K_o/4$", THIRD)):
        low, high = lifted_edges(k_h, K_O, b_o, rate_ratio=RATE_RATIO)
        closed = np.array(closed_edges(k_h, K_O, b_o))
        gap = np.abs(closed - np.array([low, high]))
        # A set that one of the two has and the other has not counts in full.
        one_only = np.isnan(closed) != np.isnan(np.array([low, high]))
        apart = max(apart, float(np.nanmax(np.where(one_only, K_O, gap))))
        curves.append(Curve(label, color, k_h, low, high))
        progress(0.1 * len(curves))
    for d, color in zip(DELAYS, (PROXY, FOURTH, LIGHT), strict=True):
        label = f"{d} period{'s' if d > 1 else ''} of delay"
        curves.append(Curve(label, color, near_k_o, *edges(near_k_o, d)))
    curves.append(Curve("(15), answer at once", GREY, near_k_o, *edges(near_k_o, AT_ONCE)))
    trials = try_both_sides(options.quick, part(progress, 0.3, 0.7))
    checks: tuple[Check, ...] = (
        at_most("largest distance of closed and lifted edge, share of K_o", apart / K_O, 1e-4),
        at_most(
            "trials on the wrong side of the edge", sum(t.stable != t.inside for t in trials), 0
        ),
        at_least("trials inside the edge that came to rest", sum(t.stable for t in trials), 3),
        at_least("trials outside that did not", sum(not t.stable for t in trials), 3),
    )
    return Outcome(
        _figure(curves, trials),
        _table(curves, trials),
        {
            "k_o_n_per_m": K_O,
            "largest_distance_n_per_m": apart,
            "trials": len(trials),
            "margin": MARGIN,
        },
        checks,
    )


def _figure(curves: list[Curve], trials: list[Trial]) -> Figure:
    """The sets as outlines, the paper's filled; trials on top."""
    figure = canvas(6.4, 4.6)
    axes = figure.subplots()
    fine = np.linspace(0.0, 3.0, 301)
    low, high = closed_edges(fine * K_O, K_O)
    axes.fill_between(fine, low / K_O, high / K_O, color=PROBE, alpha=0.10, linewidth=0)
    for curve in curves:
        some = ~np.isnan(curve.low)
        # Up along the upper edge and back along the lower one.
        x = np.concatenate([curve.k_h[some], curve.k_h[some][::-1]]) / K_O
        y = np.concatenate([curve.high[some], curve.low[some][::-1]]) / K_O
        axes.plot(x, y, color=curve.color, label=curve.label)
    # A trial has the colour of the edge that it is next to.
    of_delay = {0: PROBE, 1: PROXY, 4: LIGHT, AT_ONCE: GREY}
    for t in trials:
        axes.plot(
            t.k_h / K_O,
            t.int_ / K_O,
            "o" if t.stable else "X",
            color=of_delay[t.delay],
            markeredgecolor="black",
            markeredgewidth=0.7,
            markersize=7,
            zorder=5,
        )
    for marker, label in (("o", "trial: came to rest"), ("X", "trial: unstable")):
        axes.plot([], [], marker, color="white", markeredgecolor="black", label=label)
    axes.plot([1.0, 1.0], [0.0, 4.9], color=GREY, linewidth=0.8, linestyle=":")
    axes.annotate("$K_h = K_o$", (1.0, 4.9), color=GREY, fontsize=8, ha="center", va="bottom")
    axes.set_xlim(0.0, 4.1)
    axes.set_ylim(0.0, 5.2)
    axes.set_xlabel("$K_h / K_o$")
    axes.set_ylabel("$I N T / K_o$")
    axes.set_title("Fig. 8: stable gains of the proportional-integral local model")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _table(curves: list[Curve], trials: list[Trial]) -> Table:
    """Edges, then trials with their swing."""
    rows: list[tuple[float | int | str | None, ...]] = []
    for curve in curves:
        label = curve.label.replace("$", "")
        for k, low, high in np.stack([curve.k_h, curve.low, curve.high], axis=1).tolist():
            if not np.isnan(low):
                rows.append((label, k, low, high, None, None))
    for t in trials:
        where = "trial, at once" if t.delay == AT_ONCE else f"trial, {t.delay} periods of delay"
        rows.append((where, t.k_h, t.int_, t.int_, 1e3 * t.swing, int(t.stable)))
    columns = ("edge or trial", "K_h [N/m]", "least I N T [N/m]", "largest I N T [N/m]",
               "swing [mm]", "stable")  # fmt: skip
    return Table(columns, rows)
