"""Fig. 9: P beside PI. The integral takes the steady-state error down to its threshold.

The printed unit of I, 0.003 N/(mm s), cannot give the figure: the integral would need minutes. It
is read as 0.003 N/(mm ms) = 3000 N/(m s), so I N T = 150 N/m, which is inside the stable set (15).
`minutes_as_printed` in the summary is the time constant (K_h + K_o) / I of the error with the
printed unit, I = 3 N/(m s).

The paper says that the settling time improves with the integral. With these gains the poles say
otherwise, 1/3 per tick for P and 0.41 for PI, and so do the settling times in the summary.
"""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

from matplotlib.figure import Figure

from cohaptic.control.law import Law
from cohaptic.control.laws.model import Thresholds
from cohaptic.control.stability.single_contact import integral_is_stable
from cohaptic.protocol.messages import FixedGains
from cohaptic_experiments.outcome import (
    Number,
    Options,
    Outcome,
    Progress,
    Table,
    at_most,
    near,
    part,
)
from cohaptic_experiments.paper.measure import settling_time, swing
from cohaptic_experiments.paper.recording import Trace
from cohaptic_experiments.paper.rig import (
    COMPUTING,
    SIMULATION_PERIOD,
    START,
    Press,
    press_at_plane,
)
from cohaptic_experiments.plot_style import GREY, PROBE, PROXY, THIRD, canvas, name_line
from cohaptic_server.bodies.spring import Spring, SpringSettings

NAME = "fig09"
TITLE = "P beside PI: the integral leaves its threshold of 4 mm and no more"
K_O, K_H, INTEGRAL, THRESHOLD, DEPTH = 300.0, 100.0, 3000.0, 4e-3, 0.03
NOTE = (
    "The printed unit of I, N/(mm s), cannot give this figure; read as N/(mm ms): "
    "0.003 N/(mm ms) = 3000 N/(m s)."
)


def run(options: Options, progress: Progress) -> Outcome:
    """Press twice, hold, measure."""
    seconds = 2.0 if options.quick else 4.0
    traces: dict[Law, Trace] = {}
    for i, (law, integral) in enumerate(((Law.PROPORTIONAL, 0.0), (Law.PI, INTEGRAL))):
        press = Press(
            FixedGains(k_h=K_H, integral_gain=integral),
            DEPTH,
            seconds,
            law=law,
            # Eq. (17): one threshold, in and out.
            thresholds=Thresholds(THRESHOLD, THRESHOLD, 0.0),
            delay=COMPUTING,
        )
        body = Spring(SpringSettings(k_o=K_O))
        traces[law], _ = press_at_plane(body, press, part(progress, 0.5 * i, 0.5))
    held = START + 0.1
    gap = {law: _gap(trace) for law, trace in traces.items()}
    settled = {
        law: settling_time(trace.t, trace.proxy, held, 0.02) for law, trace in traces.items()
    }
    checks = (
        near("PI: steady distance of probe and proxy, mm", 1e3 * gap[Law.PI], 4.0, 0.01),
        near(
            "P: the same by eq. (11), mm",
            1e3 * gap[Law.PROPORTIONAL],
            1e3 * DEPTH * K_O / (K_H + K_O),
            0.02,
        ),
        at_most("PI: settling time to 2 %, s", settled[Law.PI], 1.0),
        at_most("PI: swing of the proxy in the last 0.5 s, mm", 1e3 * _swing(traces[Law.PI]), 0.02),
    )
    numbers: dict[str, Number] = {
        "note": NOTE,
        "integral_gain_n_per_m_s": INTEGRAL,
        "inside_eq_15": integral_is_stable(K_H, INTEGRAL, K_O, SIMULATION_PERIOD),
        "int_n_per_m": INTEGRAL * SIMULATION_PERIOD,
        "pi_gap_mm": 1e3 * gap[Law.PI],
        "p_gap_mm": 1e3 * gap[Law.PROPORTIONAL],
        "pi_settling_time_s": settled[Law.PI],
        "p_settling_time_s": settled[Law.PROPORTIONAL],
        "minutes_as_printed": (K_H + K_O) / (1e-3 * INTEGRAL) / 60.0,
    }
    return Outcome(_figure(traces), _table(traces), numbers, checks)


def _gap(trace: Trace) -> float:
    """Steady distance of probe and proxy [m]."""
    end = trace.last(0.5)
    return float((trace.probe[end] - trace.proxy[end]).mean())


def _swing(trace: Trace) -> float:
    """Swing of the proxy in the end [m]."""
    return swing(trace.proxy[trace.last(0.5)])


def _figure(traces: dict[Law, Trace]) -> Figure:
    """Probe, and the proxy of both laws."""
    figure = canvas()
    axes = figure.subplots()
    axes.axhline(0.0, color="black", linewidth=0.8)
    for law, color, text in ((Law.PROPORTIONAL, PROXY, "proxy, P"), (Law.PI, THIRD, "proxy, PI")):
        trace = traces[law]
        axes.plot(trace.t - START, -1e3 * trace.proxy, color=color)
        name_line(axes, -1e3 * float(trace.proxy[-1]), text, color)
    trace = traces[Law.PI]
    axes.plot(trace.t - START, -1e3 * trace.probe, color=PROBE)
    probe, proxy = -1e3 * float(trace.probe[-1]), -1e3 * float(trace.proxy[-1])
    name_line(axes, probe, "probe", PROBE)
    at = 0.7 * float(trace.t[-1] - START)
    axes.annotate("", (at, probe), (at, proxy), arrowprops={"arrowstyle": "<->", "color": GREY})
    axes.annotate(
        f"{proxy - probe:.1f} mm",
        (at, 0.5 * (probe + proxy)),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        fontsize=8,
        color=GREY,
    )
    axes.set_xlim(-0.2, float(trace.t[-1] - START))
    axes.set_xlabel("time since the approach began [s]")
    axes.set_ylabel("position [mm]")
    axes.set_title("Fig. 9: $K_o$ = 0.3 N/mm, $K_h$ = 0.1 N/mm, $I$ = 0.003 N/(mm ms)")
    return figure


def _table(traces: dict[Law, Trace]) -> Table:
    """Probe and proxy of both, every 5 ms."""
    p, pi = traces[Law.PROPORTIONAL], traces[Law.PI]
    columns = (p.t - START, 1e3 * p.probe, 1e3 * p.proxy, 1e3 * pi.probe, 1e3 * pi.proxy)
    rows = zip(*(column[::5].tolist() for column in columns), strict=True)
    names = ("t [s]", "P probe [mm]", "P proxy [mm]", "PI probe [mm]", "PI proxy [mm]")
    return Table(names, list(rows))
