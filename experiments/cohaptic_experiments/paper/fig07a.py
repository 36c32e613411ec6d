"""Fig. 7a: K_o >> K_h. The response settles at once, and the surface hardly moves.

The paper reads about 1 cm for about 6 cm off its figure; eq. (11) with its gains gives 0.6 cm, and
the check uses the latter.
"""

from __future__ import annotations

import math

from cohaptic.protocol.messages import FixedGains
from cohaptic_experiments.outcome import Options, Outcome, Progress, at_most, near
from cohaptic_experiments.paper.measure import settling_time
from cohaptic_experiments.paper.rig import SIMULATION_PERIOD, Press, press_at_plane
from cohaptic_experiments.paper.step_response import figure, table
from cohaptic_server.bodies.spring import Spring, SpringSettings

NAME = "fig07a"
TITLE = "K_o = 900, K_h = 100 N/m: no settling time, large steady-state error"
K_O, K_H, DEPTH = 900.0, 100.0, 0.06


def run(options: Options, progress: Progress) -> Outcome:
    """Press, hold, measure."""
    press = Press(FixedGains(k_h=K_H), DEPTH, 2.0 if options.quick else 5.0)
    trace, _ = press_at_plane(Spring(SpringSettings(k_o=K_O)), press, progress)
    end = trace.last(0.5)
    probe, proxy = float(trace.probe[end].mean()), float(trace.proxy[end].mean())
    settled = settling_time(trace.t, trace.proxy, press.held_from, 0.02)
    # A tick reduces the error to K_h / K_o of it; and the first tick comes up to one period late.
    ticks = 1.0 + math.ceil(math.log(0.02) / math.log(K_H / K_O))
    checks = (
        near(
            "surface moves the share of eq. (11) of the probe",
            proxy / probe,
            K_H / (K_H + K_O),
            0.02,
        ),
        at_most("settling time to 2 %, s", settled, ticks * SIMULATION_PERIOD),
    )
    numbers = {
        "probe_mm": 1e3 * probe,
        "proxy_mm": 1e3 * proxy,
        "ratio": proxy / probe,
        "ratio_eq_11": K_H / (K_H + K_O),
        "settling_time_s": settled,
        "force_n": float(trace.force[end].mean()),
    }
    return Outcome(
        figure(trace, "Fig. 7a: $K_o$ = 0.9 N/mm, $K_h$ = 0.1 N/mm"),
        table(trace),
        numbers,
        checks,
    )
