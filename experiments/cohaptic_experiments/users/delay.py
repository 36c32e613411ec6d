"""Effects of delay: one user on a spring, each law with the gains that the server chooses.

Felt stiffness is the force over the depth of the probe below the resting surface. The predictive
law gives K_o at any delay (science 3.3); P gives eq. (11); PI comes near K_o, but for its
threshold, the later the longer the delay.
"""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.figure import Figure

from cohaptic.control.gains import ALPHA
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Thresholds
from cohaptic.simulated.hand import HandScript, Intention
from cohaptic_experiments.outcome import (
    Number,
    Options,
    Outcome,
    Progress,
    Table,
    at_most,
    near,
)
from cohaptic_experiments.paper.measure import settling_time, swing
from cohaptic_experiments.paper.recording import record
from cohaptic_experiments.plot_style import PROBE, PROXY, THIRD, canvas
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.spring import Spring, SpringSettings

NAME = "delay"
TITLE = "felt stiffness, error and settling over the delay, for the three laws"
K_O, DEPTH = 200.0, 0.025
DELAYS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5)  # s, one way
STILL = 0.005  # largest swing of a force at rest, as a share of it
LAWS = {Law.PREDICTIVE: PROBE, Law.PI: THIRD, Law.PROPORTIONAL: PROXY}


@dataclass(frozen=True, slots=True)
class Point:
    """One law at one delay.

    Args:
        law: Local model.
        delay: One way [s].
        force: Steady [N].
        stiffness: Felt, steady [N/m].
        error: Steady distance of probe and proxy [m].
        swing: Swing of the force in the last second [N].
        settling: Settling of the force, to 2 % [s].
    """

    law: Law
    delay: float
    force: float
    stiffness: float
    error: float
    swing: float
    settling: float


def run(options: Options, progress: Progress) -> Outcome:
    """Every law at every delay."""
    delays = (0.0, 0.1) if options.quick else DELAYS
    points: list[Point] = []
    for law in LAWS:
        for delay in delays:
            points.append(_measure(law, delay, options.seed))
            progress(len(points) / (len(LAWS) * len(delays)))
    off = [abs(p.stiffness / K_O - 1.0) for p in points if p.law is Law.PREDICTIVE]
    worst = points[-1].delay
    felt = {p.law: p for p in points if p.delay == worst}
    expected = ALPHA / (1.0 + ALPHA) * K_O
    softer = felt[Law.PROPORTIONAL].stiffness
    checks = (
        at_most("predictive: largest difference of felt stiffness and K_o, share", max(off), 0.01),
        at_most(
            "any law: largest swing in the last second, share of the force",
            max(p.swing / p.force for p in points),
            STILL,
        ),
        near("proportional at the longest delay: felt by eq. (11), N/m", softer, expected, 0.02),
        near(
            "pi at the longest delay: steady error is its threshold, mm",
            1e3 * felt[Law.PI].error,
            1e3 * Thresholds().entering,
            0.05,
        ),
    )
    numbers: dict[str, Number] = {"k_o_n_per_m": K_O, "delays_ms": [1e3 * d for d in delays]}
    series: dict[str, Number] = {
        f"{law.value}_{name}": [scale * getattr(p, field) for p in points if p.law is law]
        for law in LAWS
        for name, field, scale in (
            ("felt_over_k_o", "stiffness", 1.0 / K_O),
            ("error_mm", "error", 1e3),
            ("settling_time_s", "settling", 1.0),
            ("swing_n", "swing", 1.0),
        )
    }
    return Outcome(_figure(points), _table(points), numbers | series, checks)


def _measure(law: Law, delay: float, seed: int) -> Point:
    """Press, and wait until slow loops have settled."""
    # The hand is engaged, and patches have come, before it approaches.
    begin = 1.5 + 2.0 * delay
    press = Intention((0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), DEPTH, approach_at=begin)
    session = VirtualSession(Spring(SpringSettings(k_o=K_O)))
    session.join(
        "user", HandScript(), law=law, delay=delay, jitter=0.1 * delay, seed=seed, intention=press
    )
    trace = record(session, {"user": press}, begin + 5.0 + 40.0 * delay, lambda _: None)["user"]
    end = trace.last(0.5)
    force, probe = float(trace.force[end].mean()), float(trace.probe[end].mean())
    return Point(
        law,
        delay,
        force,
        force / probe,
        probe - float(trace.proxy[end].mean()),
        swing(trace.force[trace.last(1.0)]),
        settling_time(trace.t, trace.force, begin + press.approach_time, 0.02),
    )


def _figure(points: list[Point]) -> Figure:
    """Stiffness, error and settling time over the delay."""
    figure = canvas(6.8, 2.9)
    left, middle, right = figure.subplots(1, 3)
    for law, color in LAWS.items():
        some = [p for p in points if p.law is law]
        x = [1e3 * p.delay for p in some]
        style = {"color": color, "marker": "o", "markersize": 4}
        left.plot(x, [p.stiffness / K_O for p in some], label=law.value, **style)
        middle.plot(x, [1e3 * p.error for p in some], **style)
        right.plot(x, [p.settling for p in some], **style)
    left.set_ylim(0.0, 1.1)
    left.set_title("felt stiffness / $K_o$")
    middle.set_title("probe to proxy, steady [mm]")
    middle.set_ylim(bottom=-0.2)
    right.set_title("settling time to 2 % [s]")
    right.set_ylim(bottom=0.0)
    for axes in (left, middle, right):
        axes.set_xlabel("one-way delay [ms]")
    figure.legend(loc="outside lower center", ncols=len(LAWS))
    return figure


def _table(points: list[Point]) -> Table:
    """All points."""
    columns = (
        "law",
        "delay [ms]",
        "felt stiffness [N/m]",
        "error [mm]",
        "swing [N]",
        "settling [s]",
    )
    return Table(
        columns,
        [
            (p.law.value, 1e3 * p.delay, p.stiffness, 1e3 * p.error, p.swing, p.settling)
            for p in points
        ],
    )
