"""Two users whose hands move, and three who hold still: how much lag is needed, by whom.

Held still, two users need none: S_12 < 1, since an elastic body stores energy (science 3.8). What
two hands need because they move is compared by the criteria of `criteria.py`, over the delay, the
coupling and the ratio of both delays. Three close users are the first who need a lag at rest: there
the theorem's edge stands beside the exact one (`held_edges`), over the ratio of their delays.
"""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cohaptic_experiments.dyad.criteria import (
    Dyad,
    Hand,
    at_any_delay,
    by_crossings,
    by_roots,
    by_rule,
    by_small_gain,
    stiffest_spring,
)
from cohaptic_experiments.dyad.held_edges import edge_by_roots, edge_by_small_gain, edge_by_theorem
from cohaptic_experiments.outcome import (
    Check,
    Number,
    Options,
    Outcome,
    Progress,
    Table,
    at_least,
    at_most,
    near,
    part,
)
from cohaptic_experiments.plot_style import FOURTH, PROBE, PROXY, canvas, name_line
from cohaptic_server.numeric import Floats

NAME = "dyad"
TITLE = "lag that two moving hands need, by five criteria; and three held ones: the theorem's edge"
HAND = Hand(mass=0.4, damping=4.0, stiffness=200.0, gain=400.0)
COUPLING = 0.65  # of two hands on opposite sides of the balloon
DELAY = 0.2  # s, round one loop
CLOSE = (0.6, 0.75, 0.95)  # couplings of three users; m is twice that
OURS, ROOTS, GAIN, CROSSINGS, ANY = "ours", "exact", "small gain", "zero crossings", "any delay"
CRITERIA: dict[str, Callable[[Dyad], float]] = {
    OURS: by_rule,
    GAIN: by_small_gain,
    CROSSINGS: by_crossings,
    ANY: at_any_delay,
    ROOTS: by_roots,
}
LOOKS = {
    OURS: ("black", "-", r"ours: $\tau = \theta c$, or the theorem"),
    GAIN: (FOURTH, "--", "small gain"),
    CROSSINGS: (PROXY, "-", "zero crossings (Du et al. 2025)"),
    ROOTS: (PROBE, "-", "exact: roots"),
}

Row = tuple[float | int | str | None, ...]
Curves = Mapping[str, Floats]


def run(options: Options, progress: Progress) -> Outcome:
    """Curves over delay and coupling, a map over coupling and ratio, and the trio."""
    n, size, m = (7, 4, 5) if options.quick else (81, 21, 33)
    delays, couplings = np.linspace(0.005, 0.4, n), np.linspace(0.02, 0.98, n)
    over_delay = _curves([_dyad(COUPLING, T, T) for T in delays.tolist()])
    progress(0.15)
    over_coupling = _curves([_dyad(c, DELAY, DELAY) for c in couplings.tolist()])
    progress(0.3)
    ratios, strengths = np.linspace(0.05, 1.0, size), np.linspace(0.1, 0.98, size)
    fractions = np.zeros((size, size))
    for i, c in enumerate(strengths.tolist()):
        for j, ratio in enumerate(ratios.tolist()):
            dyad = _dyad(c, DELAY, ratio * DELAY)
            fractions[i, j] = by_roots(dyad) / by_rule(dyad)
        progress(0.3 + 0.4 * (i + 1) / size)
    apart = np.linspace(0.05, 1.0, m)
    trio = {c: _trio(c, apart, part(progress, 0.7, 0.3)) for c in CLOSE}

    figure = canvas(7.2, 5.4)
    (first, second), (third, fourth) = figure.subplots(2, 2)
    _lines(first, 1e3 * delays, over_delay)
    first.set_xlabel("loop delay of both [ms]")
    first.set_title(f"two moving hands, c = {COUPLING:g}")
    _lines(second, couplings, over_coupling)
    second.set_xlabel("coupling c")
    second.set_title(f"two moving hands, {1e3 * DELAY:g} ms each")
    _map(figure, third, ratios, strengths, fractions)
    _three(fourth, apart, trio)
    figure.legend(*first.get_legend_handles_labels(), loc="outside lower center", ncols=4)

    rows = _rows("delay [s]", delays, over_delay) + _rows("coupling", couplings, over_coupling)
    for c, row in zip(strengths.tolist(), fractions, strict=True):
        rows += _rows(f"ratio of delays at c = {c:.3g}", ratios, {"exact over ours": row})
    for c, curves in trio.items():
        rows += _rows(f"ratio of delays of three, c = {c:g}", apart, curves)
    numbers: dict[str, Number] = {
        "theta_s": HAND.time,
        "exact_over_ours_largest": float(fractions.max()),
        "exact_over_theorem_at_least_ratio": [
            float(t[ROOTS][0] / t[OURS][0]) for t in trio.values()
        ],
        "small_gain_over_theorem": [float((t[GAIN] / t[OURS]).max()) for t in trio.values()],
    }
    table = Table(("over", "value", "criterion", "lag [s], or a share"), rows)
    return Outcome(figure, table, numbers, _checks((over_delay, over_coupling), fractions, trio))


def _dyad(c: float, first: float, second: float) -> Dyad:
    return Dyad((HAND, HAND), c, (first, second))


def _curves(dyads: list[Dyad]) -> Curves:
    """The lag by every criterion [s]."""
    return {name: np.array([lag(dyad) for dyad in dyads]) for name, lag in CRITERIA.items()}


def _trio(c: float, ratios: Floats, progress: Progress) -> Curves:
    """Edges of three held users, one of whom is far away: the others have a share of its delay."""
    S = c * (np.ones((3, 3)) - np.eye(3))
    delays = [DELAY * np.array([1.0, ratio, ratio]) for ratio in ratios.tolist()]
    progress(list(CLOSE).index(c) / len(CLOSE))
    return {
        OURS: np.array([edge_by_theorem(S, T) for T in delays]),
        ROOTS: np.array([edge_by_roots(S, T) for T in delays]),
        GAIN: np.array([edge_by_small_gain(S, T) for T in delays]),
    }


def _checks(
    dyads: tuple[Curves, Curves], fractions: Floats, trio: Mapping[float, Curves]
) -> tuple[Check, ...]:
    """No criterion calls an unstable dyad stable, and the theorem is exact for equal delays."""
    crossed = max(float((d[ROOTS] - d[CROSSINGS]).max()) for d in dyads)
    unlike = by_roots(_dyad(0.9, 0.05, 0.25)) / by_roots(_dyad(0.9, 0.15, 0.15))
    free = (Hand(0.3, 3.0, 0.0, 1.0), Hand(0.4, 5.0, 0.0, 1.0))
    expected = (3.0**2 + 5.0**2) / (2.0 * (0.3 + 0.4))
    like = np.mean([t[ROOTS][-1] / t[OURS][-1] for t in trio.values()])
    fraction = max(float((t[ROOTS] / t[OURS]).max()) for t in trio.values())
    gain = min(float((t[GAIN] / t[OURS]).min()) for t in trio.values())
    return (
        at_most("two moving hands: exact lag over ours, largest", float(fractions.max()), 1.0),
        at_most("two moving hands: exact lag above that by zero crossings, s", crossed, 1e-3),
        near("two moving hands: lag of unlike delays over that of like ones with the same sum",
             unlike, 1.0, 0.01),
        near("two free hands and a spring: stiffness that bears any delay, N/m (Du et al. 2025)",
             stiffest_spring(free), expected, 0.01),
        near("three held hands, like delays: exact lag over the theorem's", float(like), 1.0, 0.01),
        at_most("three held hands, any delays: exact lag over the theorem's, largest", fraction,
        1.01), at_least("three held hands: lag by small gain over the theorem's, least", gain, 1.0),
    )  # fmt: skip


def _rows(over: str, x: Floats, curves: Curves) -> list[Row]:
    return [
        (over, a, name, b)
        for name, y in curves.items()
        for a, b in zip(x.tolist(), y.tolist(), strict=True)
    ]


def _lines(axes: Axes, x: Floats, curves: Curves) -> None:
    """Lags by every criterion."""
    for name, (color, style, label) in LOOKS.items():
        axes.plot(x, 1e3 * curves[name], color=color, linestyle=style, label=label)
    axes.set_ylim(bottom=-2.0)
    axes.set_ylabel(r"lag needed $\tau$ [ms]")


def _map(figure: Figure, axes: Axes, ratios: Floats, strengths: Floats, fractions: Floats) -> None:
    """The exact lag as a share of ours."""
    shown = axes.pcolormesh(
        ratios, strengths, fractions, cmap="Blues", vmin=0.0, vmax=1.0, shading="gouraud"
    )
    axes.grid(False)
    axes.set_xlabel(f"ratio of delays; the longer is {1e3 * DELAY:g} ms")
    axes.set_ylabel("coupling c")
    axes.set_title("two moving hands: exact lag as a share of ours")
    figure.colorbar(shown, ax=axes)


def _three(axes: Axes, ratios: Floats, trio: Mapping[float, Curves]) -> None:
    """Edges of three held users over the longest delay."""
    for c, curves in trio.items():
        for name, y in curves.items():
            color, style, _ = LOOKS[name]
            axes.plot(ratios, y / DELAY, color=color, linestyle=style)
        name_line(axes, float(curves[OURS][-1]) / DELAY, f"c = {c:g}", "black")
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    axes.set_xlabel("delay of two users over that of the third")
    axes.set_ylabel(r"lag needed $\tau / T_{max}$")
    axes.set_title("three held hands")
