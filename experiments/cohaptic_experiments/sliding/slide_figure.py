"""A hand that slides over the balloon: error of the force by geometry of the patch.

While a patch is on its way the probe moves v t along the surface. A plane is then off by about
(v t)^2 / (2 R) (science 3.7), a sphere by the change of the curvature, a mesh patch by neither. The
measurement is in `slide.py`.
"""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

from dataclasses import astuple, fields

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cohaptic.protocol.messages import GeometryName
from cohaptic_experiments.outcome import (
    Check,
    Number,
    Options,
    Outcome,
    Progress,
    Table,
    at_least,
    at_most,
)
from cohaptic_experiments.plot_style import PROBE, PROXY, THIRD, canvas
from cohaptic_experiments.sliding.slide import SlideResult, measure
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings

NAME = "slide"
TITLE = "sliding over the balloon: error of the force with plane, sphere and mesh patches"
GEOMETRIES: dict[GeometryName, str] = {"plane": PROXY, "sphere": THIRD, "mesh": PROBE}
SPEED, DELAY = 0.1, 0.08  # m/s; s, one way: the case of science 3.7
SPEEDS = (0.02, 0.05, SPEED, 0.2, 0.3)
DELAYS = (0.0, 0.04, DELAY, 0.15, 0.25)
DEPTH = 0.01


def run(options: Options, progress: Progress) -> Outcome:
    """Every geometry: over the speed at one delay, and over the delay at one speed."""
    # Mesh patches are cut from the body's own mesh; a coarse one would be another experiment.
    body = Balloon(BalloonSettings())
    cases = {(SPEED, DELAY)}
    if not options.quick:
        cases |= {(v, DELAY) for v in SPEEDS} | {(SPEED, d) for d in DELAYS}
    results: list[SlideResult] = []
    for geometry in GEOMETRIES:
        for speed, delay in sorted(cases):
            angle = 0.3 if options.quick else 1.0
            results.append(measure(geometry, speed, delay, body=body, depth=DEPTH, angle=angle))
            progress(len(results) / (len(GEOMETRIES) * (len(cases) + 1)))
    # On the way to the pole the stiffness changes by half, which a plane or a sphere cannot know.
    angle = 0.3 if options.quick else 1.5
    over_pole = {
        g: measure(g, SPEED, DELAY, body=body, depth=DEPTH, angle=angle, upwards=True)
        for g in GEOMETRIES
    }
    progress(1.0)
    case = {r.geometry: r for r in results if (r.speed, r.delay) == (SPEED, DELAY)}
    where = f"at {SPEED:g} m/s and {1e3 * DELAY:g} ms"
    checks: tuple[Check, ...] = (
        at_most(f"mesh {where}: largest error, share of the force", case["mesh"].worst, 0.05),
        at_most(f"mesh {where}: largest step in 1 ms, share", case["mesh"].step, 0.02),
        at_most(f"mesh {where}, over the pole: largest error", over_pole["mesh"].worst, 0.05),
        at_least(f"plane {where}: median error, share", case["plane"].median, 0.05),
        at_most(
            f"mesh over plane {where}: ratio of the median errors",
            case["mesh"].median / case["plane"].median,
            0.2,
        ),
    )
    numbers: dict[str, Number] = {
        f"{g}_{name}": getattr(r, name)
        for g, r in case.items()
        for name in ("median", "p95", "worst", "step")
    }
    numbers |= {f"{g}_over_the_pole_worst": r.worst for g, r in over_pole.items()}
    return Outcome(_figure(results), _table(results), numbers, checks)


def _figure(results: list[SlideResult]) -> Figure:
    """Error and largest step, over the speed and over the delay."""
    figure = canvas(6.8, 4.4)
    axes = figure.subplots(2, 2, sharey="row", sharex="col")
    for geometry, color in GEOMETRIES.items():
        mine = [r for r in results if r.geometry == geometry]
        over_speed = [r for r in mine if r.delay == DELAY]
        over_delay = [r for r in mine if r.speed == SPEED]
        _line(axes[0, 0], [(r.speed, r.p95) for r in over_speed], color, geometry)
        _line(axes[0, 1], [(1e3 * r.delay, r.p95) for r in over_delay], color)
        _line(axes[1, 0], [(r.speed, r.step) for r in over_speed], color)
        _line(axes[1, 1], [(1e3 * r.delay, r.step) for r in over_delay], color)
    for row in axes:
        row[0].set_yscale("log")
        row[0].yaxis.set_major_formatter("{x:g}")
    axes[0, 0].axhline(5.0, color="black", linewidth=0.7, linestyle=":")
    axes[0, 1].axhline(5.0, color="black", linewidth=0.7, linestyle=":")
    axes[0, 0].set_ylabel("error of the force, p95 [%]")
    axes[1, 0].set_ylabel("largest step in 1 ms [%]")
    axes[0, 0].set_title(f"{1e3 * DELAY:g} ms each way")
    axes[0, 1].set_title(f"{SPEED:g} m/s")
    axes[1, 0].set_xlabel("speed along the surface [m/s]")
    axes[1, 1].set_xlabel("one-way delay [ms]")
    figure.legend(loc="outside lower center", ncols=len(GEOMETRIES))
    return figure


def _line(axes: Axes, points: list[tuple[float, float]], color: str, label: str = "") -> None:
    x = [p[0] for p in points]
    y = [100.0 * p[1] for p in points]
    axes.plot(x, y, color=color, marker="o", markersize=4, label=label or "_")


def _table(results: list[SlideResult]) -> Table:
    """Every field of every result, in SI units; errors as shares of the force."""
    names = tuple(field.name for field in fields(SlideResult))
    return Table(names, [astuple(r) for r in results])
