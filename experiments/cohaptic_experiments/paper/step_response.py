"""Figs. 7a, 7b and 7c: three presses of one kind, with different gains."""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

from matplotlib.figure import Figure

from cohaptic_experiments.outcome import Table
from cohaptic_experiments.paper.recording import Trace
from cohaptic_experiments.paper.rig import START
from cohaptic_experiments.plot_style import PROBE, PROXY, canvas, name_line

_EVERY = 5  # ms between rows of the table


def table(trace: Trace) -> Table:
    """Probe, proxy and force over time."""
    rows = zip(
        (trace.t[::_EVERY] - START).tolist(),
        (1e3 * trace.probe[::_EVERY]).tolist(),
        (1e3 * trace.proxy[::_EVERY]).tolist(),
        trace.force[::_EVERY].tolist(),
        strict=True,
    )
    return Table(("t [s]", "probe x_h [mm]", "proxy x_o [mm]", "force [N]"), list(rows))


def figure(trace: Trace, title: str) -> Figure:
    """Probe and proxy over time, as the paper draws them: down is into the object."""
    drawn = canvas()
    axes = drawn.subplots()
    t = trace.t - START
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.plot(t, -1e3 * trace.probe, color=PROBE)
    axes.plot(t, -1e3 * trace.proxy, color=PROXY)
    name_line(axes, -1e3 * float(trace.probe[-1]), "probe $x_h$", PROBE)
    name_line(axes, -1e3 * float(trace.proxy[-1000:].mean()), "proxy $x_o$", PROXY)
    axes.set_xlim(-0.3, float(t[-1]))
    axes.set_xlabel("time since the approach began [s]")
    axes.set_ylabel("position [mm]")
    axes.set_title(title)
    return drawn
