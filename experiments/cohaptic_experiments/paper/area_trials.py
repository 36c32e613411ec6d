"""Trials next to the edges of Fig. 8, on the real session.

In eq. (13) the force goes to the simulation when a new surface has just come, and the answer is
there one period later. Our server answers at once, to a sample sent just before its tick: that
force holds the integral over nearly the whole period as well, K_h + j I T for a sample j haptic
periods after the surface. Such a loop is eq. (15) with K_h + j I T for K_h: another set. It has the
paper's set when the way over the network takes one period (`rig.COMPUTING`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cohaptic.control.law import Law
from cohaptic.control.laws.model import Thresholds
from cohaptic.control.stability.stable_set import lifted_edges
from cohaptic.protocol.messages import FixedGains
from cohaptic_experiments.outcome import Progress
from cohaptic_experiments.paper.measure import swing
from cohaptic_experiments.paper.rig import COMPUTING, SIMULATION_PERIOD, Press, press_at_plane
from cohaptic_server.bodies.spring import Spring, SpringSettings
from cohaptic_server.numeric import Floats

K_O = 200.0
AT_ONCE = -1  # in place of a number of further periods: the server's answer takes no time
LATE = 48.0 / 50.0  # j / N of a sample that leaves 2 ms before the tick
# Far from the edge of contact: a threshold of 20 mm leaves the loop room to swing in.
THETA = Thresholds(0.02, 0.02, 0.0)
DEPTH = 0.06
STILL = 0.002  # m; swing of x_o in the last second below which a trial counts as stable
# K_h / K_o, which edge, and periods of delay beyond the paper's; tried on either side by MARGIN.
TRIALS = ((0.2, "high", 0), (0.8, "high", 0), (1.2, "low", 0), (1.2, "high", 0), (0.4, "high", 1),
          (0.8, "high", 1), (0.4, "high", 4), (0.2, "high", AT_ONCE), (0.7, "high", AT_ONCE),
          )  # fmt: skip
MARGIN = 0.12
LOW_MARGIN = 0.15  # of K_o


@dataclass(frozen=True, slots=True)
class Trial:
    """One press with gains next to the edge.

    Args:
        k_h: [N/m].
        int_: I N T [N/m].
        delay: Simulation periods beyond the paper's one.
        inside: Whether theory has it stable.
        swing: Swing of x_o in the last second [m].
    """

    k_h: float
    int_: float
    delay: int
    inside: bool
    swing: float

    @property
    def stable(self) -> bool:
        """Whether it came to rest."""
        return self.swing < STILL


def edges(k_h: Floats, delay: int) -> tuple[Floats, Floats]:
    """Least and largest stable I N T for a delay in periods, or for an answer at once."""
    if delay != AT_ONCE:
        return lifted_edges(k_h, K_O, delay_samples=delay)
    # Eq. (15) with K_h + LATE I N T for K_h.
    high = np.minimum((k_h + K_O) / (1.0 - LATE), (2.0 * K_O - 2.0 * k_h) / (2.0 * LATE - 1.0))
    some = high > 0.0
    return np.where(some, 0.0, np.nan), np.where(some, high, np.nan)


def try_both_sides(quick: bool, progress: Progress) -> list[Trial]:
    """Press with gains on either side of the edge, on the real session."""
    chosen = (TRIALS[1], TRIALS[4], TRIALS[8]) if quick else TRIALS
    trials: list[Trial] = []
    for fraction, edge, delay in chosen:
        k = fraction * K_O
        low, high = (float(e[0]) for e in edges(np.array([k]), delay))
        at = high if edge == "high" else low
        for side in (-1.0, 1.0):
            # Of the lower edge a share would be too little: towards K_h = K_o it goes to 0.
            int_ = at + side * (MARGIN * at if edge == "high" else LOW_MARGIN * K_O)
            press = Press(
                FixedGains(k_h=k, integral_gain=int_ / SIMULATION_PERIOD),
                DEPTH,
                9.0 + 2.0 * max(0, delay),
                law=Law.PI,
                approach_time=1.0,
                thresholds=THETA,
                delay=0.0 if delay == AT_ONCE else COMPUTING + 0.5 * delay * SIMULATION_PERIOD,
            )
            trace, _ = press_at_plane(Spring(SpringSettings(k_o=K_O)), press, lambda _: None)
            moved = swing(trace.proxy[trace.last(1.0)])
            trials.append(Trial(k, int_, delay, low < int_ < high, moved))
            progress(len(trials) / (2 * len(chosen)))
    return trials
