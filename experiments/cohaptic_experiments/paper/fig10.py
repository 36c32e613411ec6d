"""Fig. 10: a triangle mesh pressed with K_h = 0.6 and 0.7 N/mm. Both stable; the higher is nearer.

The paper says both that the difference between probe and proxy is lower with 0.6 ("in the first
case") and that the second case has the lower steady-state error. By eq. (11) it is the higher gain
that has the lower error, x_h K_o / (K_h + K_o), and the checks follow it.
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
from cohaptic_experiments.outcome import (
    Check,
    Options,
    Outcome,
    Progress,
    Table,
    at_least,
    at_most,
    near,
    part,
)
from cohaptic_experiments.paper.measure import swing
from cohaptic_experiments.paper.recording import Trace
from cohaptic_experiments.paper.rig import START, Press, press_at_plane
from cohaptic_experiments.paper.stiff_balloon import stiff_balloon, stiffness_at_x
from cohaptic_experiments.plot_style import PROBE, PROXY, canvas, name_line
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats

NAME = "fig10"
TITLE = "triangle mesh, K_o = 1000, K_h = 600 and 700 N/m: stable, the higher gain is nearer"
GAINS = (700.0, 600.0)  # (a) and (b) of the figure
DEPTH = 0.03


@dataclass(frozen=True, eq=False)
class Case:
    """One gain.

    Args:
        k_h: [N/m].
        trace: Trace of the press.
        displacement: Displacement of the mesh in the end, shape (n, 3) [m].
        probe: In the end, shape (3,) [m].
    """

    k_h: float
    trace: Trace
    displacement: Floats
    probe: Floats

    @property
    def gap(self) -> float:
        """Steady distance of probe and proxy [m]."""
        end = self.trace.last(0.5)
        return float((self.trace.probe[end] - self.trace.proxy[end]).mean())


def run(options: Options, progress: Progress) -> Outcome:
    """Press with both gains."""
    body = stiff_balloon(quick=options.quick)
    k_o = stiffness_at_x(body)
    cases: list[Case] = []
    for i, k_h in enumerate(GAINS):
        press = Press(FixedGains(k_h=k_h), DEPTH, 2.0 if options.quick else 4.0)
        trace, session = press_at_plane(body, press, part(progress, 0.5 * i, 0.5))
        response = session.room.world.response
        assert response is not None
        tip = np.array(session.users["clamp"].state.probe)
        cases.append(Case(k_h, trace, response.displacement, tip))
    checks: list[Check] = []
    for case in cases:
        swung = swing(case.trace.proxy[case.trace.last(0.5)])
        name = f"K_h = {case.k_h:g} N/m"
        checks.append(
            at_most(f"{name}: swing of the proxy in the last 0.5 s, mm", 1e3 * swung, 0.02)
        )
        expected = 1e3 * DEPTH * k_o / (k_o + case.k_h)
        checks.append(near(f"{name}: distance by eq. (11), mm", 1e3 * case.gap, expected, 0.02))
    nearer = 1e3 * (cases[1].gap - cases[0].gap)
    checks.append(at_least("700 N/m is nearer than 600 N/m by, mm", nearer, 0.5))
    numbers = {
        "k_o_n_per_m": k_o,
        "vertices": len(body.mesh.vertices),
        **{f"gap_{case.k_h:.0f}_mm": 1e3 * case.gap for case in cases},
        **{f"force_{case.k_h:.0f}_n": float(case.trace.force[-1]) for case in cases},
    }
    return Outcome(_figure(body.mesh, cases), _table(cases), numbers, tuple(checks))


def _figure(mesh: SurfaceMesh, cases: list[Case]) -> Figure:
    """For each gain the mesh at rest under the probe, and the way there."""
    figure = canvas(6.4, 4.8)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.35, 1.0))
    deepest = 1e3 * max(float(case.trace.proxy[-1]) for case in cases)
    scale = Normalize(-0.2 * deepest, deepest)
    tops: list[Axes] = []
    for i, case in enumerate(cases):
        letter = "ab"[i]
        top = figure.add_subplot(grid[0, i], projection="3d")
        draw_mesh(top, mesh, case.displacement, case.probe, scale)
        top.set_title(f"({letter}) $K_h$ = {1e-3 * case.k_h:g} N/mm", y=1.04)
        tops.append(top)
        axes = figure.add_subplot(grid[1, i])
        t = case.trace.t - START
        axes.axhline(0.0, color="black", linewidth=0.8)
        axes.plot(t, -1e3 * case.trace.probe, color=PROBE)
        axes.plot(t, -1e3 * case.trace.proxy, color=PROXY)
        name_line(axes, -1e3 * float(case.trace.probe[-1]), "probe", PROBE)
        name_line(axes, -1e3 * float(case.trace.proxy[-1]), "proxy", PROXY)
        axes.set_title(f"{1e3 * case.gap:.1f} mm apart")
        axes.set_xlim(-0.1, 1.5)
        axes.set_xlabel("time [s]")
        if i == 0:
            axes.set_ylabel("position [mm]")
    figure.colorbar(
        ScalarMappable(scale, COLORS), ax=tops, label="surface moved in [mm]", shrink=0.75
    )
    return figure


def _table(cases: list[Case]) -> Table:
    """Probe and proxy of both, every 5 ms."""
    columns = [cases[0].trace.t - START]
    names = ["t [s]"]
    for case in cases:
        columns += [1e3 * case.trace.probe, 1e3 * case.trace.proxy]
        names += [f"probe at {case.k_h:g} N/m [mm]", f"proxy at {case.k_h:g} N/m [mm]"]
    return Table(tuple(names), list(zip(*(c[::5].tolist() for c in columns), strict=True)))
