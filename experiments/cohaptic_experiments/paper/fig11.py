"""Fig. 11: the mesh of Fig. 10 with K_h = 1.2 N/mm, above its K_o of 1 N/mm: unstable.

Frames of the sequence, tick after tick, and the way there. The clamp starts at rest on the surface,
so that the oscillation begins small and its growth can be seen.
"""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from cohaptic.protocol.messages import FixedGains
from cohaptic_experiments.mesh_picture import COLORS, draw_mesh
from cohaptic_experiments.outcome import Options, Outcome, Progress, at_least, near
from cohaptic_experiments.paper.measure import growth_per_tick, swing
from cohaptic_experiments.paper.recording import Trace
from cohaptic_experiments.paper.rig import SIMULATION_PERIOD, START, Press, press_at_plane
from cohaptic_experiments.paper.step_response import table
from cohaptic_experiments.paper.stiff_balloon import stiff_balloon, stiffness_at_x
from cohaptic_experiments.plot_style import GREY, PROBE, PROXY, canvas, name_line
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats

NAME = "fig11"
TITLE = "triangle mesh, K_o = 1000, K_h = 1200 N/m: unstable"
K_H, DEPTH = 1200.0, 0.02
FRAMES = 4


@dataclass(frozen=True, eq=False)
class Frame:
    """The mesh after one tick.

    Args:
        t: Since the approach began [s].
        displacement: Shape (n, 3) [m].
        probe: Shape (3,) [m].
    """

    t: float
    displacement: Floats
    probe: Floats


def run(options: Options, progress: Progress) -> Outcome:
    """Press, and look at the last ticks."""
    body = stiff_balloon(quick=options.quick)
    k_o = stiffness_at_x(body)
    press = Press(FixedGains(k_h=K_H), DEPTH, 3.0, approach_time=0.3, clearance=0.0)
    trace, session = press_at_plane(body, press, progress)
    held = round(press.held_from / SIMULATION_PERIOD) + 1
    growth = growth_per_tick(trace.per_tick()[held:], 1e-6, 0.5 * DEPTH)
    root = press.effective_gain() / k_o
    fraction = swing(trace.proxy[trace.last(0.5)]) / DEPTH
    frames: list[Frame] = []
    for _ in range(FRAMES):
        response = session.room.world.response
        assert response is not None
        tip = np.array(session.users["clamp"].state.probe)
        frames.append(Frame(session.now - 100.0 - START, response.displacement, tip))
        session.run(SIMULATION_PERIOD)
    checks = (
        near("oscillation grows per tick by the root K_h / K_o", growth, root, 0.02),
        at_least("in the end the surface swings by this share of the probe's depth", fraction, 0.9),
    )
    numbers = {
        "k_o_n_per_m": k_o,
        "growth_per_tick": growth,
        "root": root,
        "final_swing_mm": 1e3 * fraction * DEPTH,
        "largest_force_n": float(trace.force.max()),
    }
    return Outcome(_figure(body.mesh, trace, frames), table(trace), numbers, checks)


def _figure(mesh: SurfaceMesh, trace: Trace, frames: list[Frame]) -> Figure:
    """Frames on top, the way there below."""
    figure = canvas(6.8, 4.2)
    grid = figure.add_gridspec(2, len(frames), height_ratios=(1.0, 1.2))
    scale = Normalize(-0.2e3 * DEPTH, 1.2e3 * DEPTH)
    tops: list[Axes] = []
    for i, frame in enumerate(frames):
        top = figure.add_subplot(grid[0, i], projection="3d")
        draw_mesh(top, mesh, frame.displacement, frame.probe, scale)
        top.set_title(f"{frame.t:.2f} s", loc="center", y=1.02)
        tops.append(top)
    figure.colorbar(
        ScalarMappable(scale, COLORS), ax=tops, label="surface moved in [mm]", shrink=0.9
    )
    axes = figure.add_subplot(grid[1, :])
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.plot(trace.t - START, -1e3 * trace.probe, color=PROBE)
    axes.plot(trace.t - START, -1e3 * trace.proxy, color=PROXY)
    name_line(axes, -1e3 * float(trace.probe[-1]), "probe $x_h$", PROBE)
    name_line(axes, -1e3 * float(trace.proxy[-1000:].mean()), "proxy $x_o$", PROXY)
    end = float(trace.t[-1] - START)
    axes.set_xlim(-0.2, end)
    axes.annotate(
        "frames above follow", (end, 0.0), xytext=(-2, 5), textcoords="offset points",
        ha="right", fontsize=8, color=GREY,
    )  # fmt: skip
    axes.set_xlabel("time since the approach began [s]")
    axes.set_ylabel("position [mm]")
    axes.set_title("Fig. 11: $K_o$ = 1 N/mm, $K_h$ = 1.2 N/mm")
    return figure
