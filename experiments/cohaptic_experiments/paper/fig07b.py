"""Fig. 7b: K_h close to K_o. A smaller error, and an oscillation that takes seconds to settle."""

from __future__ import annotations

import math

from cohaptic.protocol.messages import FixedGains
from cohaptic_experiments.outcome import Check, Options, Outcome, Progress, near
from cohaptic_experiments.paper.measure import growth_per_tick, settling_time
from cohaptic_experiments.paper.rig import SIMULATION_PERIOD, Press, press_at_plane
from cohaptic_experiments.paper.step_response import figure, table
from cohaptic_server.bodies.spring import Spring, SpringSettings

NAME = "fig07b"
TITLE = "K_o = 200, K_h = 190 N/m: half the error, oscillation for seconds"
K_O, K_H, DEPTH = 200.0, 190.0, 0.05


def run(options: Options, progress: Progress) -> Outcome:
    """Press, hold, measure."""
    press = Press(FixedGains(k_h=K_H), DEPTH, 6.0 if options.quick else 8.0)
    trace, _ = press_at_plane(Spring(SpringSettings(k_o=K_O)), press, progress)
    end = trace.last(1.0)
    probe, proxy = float(trace.probe[end].mean()), float(trace.proxy[end].mean())
    settled = settling_time(trace.t, trace.proxy, press.held_from, 0.05)
    held = round(press.held_from / SIMULATION_PERIOD) + 1
    decay = growth_per_tick(trace.per_tick()[held:], 1e-6, 0.05)
    root = press.effective_gain() / K_O
    checks = (
        near(
            "surface moves the share of eq. (11) of the probe",
            proxy / probe,
            K_H / (K_H + K_O),
            0.02,
        ),
        near("oscillation left after a tick, as the root K_h / K_o", decay, root, 0.01),
        Check("settling time to 5 %, s; the paper says about 2", settled, 1.0, 4.0),
    )
    numbers = {
        "probe_mm": 1e3 * probe,
        "proxy_mm": 1e3 * proxy,
        "ratio": proxy / probe,
        "ratio_eq_11": K_H / (K_H + K_O),
        "settling_time_s": settled,
        "full_swing_to_5_percent_s": SIMULATION_PERIOD * math.log(0.05) / math.log(root),
        "decay_per_tick": decay,
        "root": root,
    }
    return Outcome(
        figure(trace, "Fig. 7b: $K_o$ = 0.2 N/mm, $K_h$ = 0.19 N/mm"),
        table(trace),
        numbers,
        checks,
    )
