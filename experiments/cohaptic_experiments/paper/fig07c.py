"""Fig. 7c: K_h above K_o. The oscillation grows until the contact opens at every other tick.

The clamp comes slowly, so that the oscillation begins small and its growth can be seen.
"""

from __future__ import annotations

from cohaptic.protocol.messages import FixedGains
from cohaptic_experiments.outcome import Options, Outcome, Progress, at_least, near
from cohaptic_experiments.paper.measure import growth_per_tick, swing
from cohaptic_experiments.paper.rig import SIMULATION_PERIOD, Press, press_at_plane
from cohaptic_experiments.paper.step_response import figure, table
from cohaptic_server.bodies.spring import Spring, SpringSettings

NAME = "fig07c"
TITLE = "K_o = 200, K_h = 220 N/m: unstable"
K_O, K_H, DEPTH = 200.0, 220.0, 0.06


def run(options: Options, progress: Progress) -> Outcome:
    """Press, hold, measure."""
    press = Press(FixedGains(k_h=K_H), DEPTH, 5.0 if options.quick else 6.0, approach_time=0.5)
    trace, _ = press_at_plane(Spring(SpringSettings(k_o=K_O)), press, progress)
    held = round(press.held_from / SIMULATION_PERIOD) + 1
    growth = growth_per_tick(trace.per_tick()[held:], 1e-6, 0.5 * DEPTH)
    root = press.effective_gain() / K_O
    fraction = swing(trace.proxy[trace.last(0.5)]) / DEPTH
    checks = (
        near("oscillation grows per tick by the root K_h / K_o", growth, root, 0.01),
        at_least("in the end the surface swings by this share of the probe's depth", fraction, 0.9),
    )
    numbers = {
        "growth_per_tick": growth,
        "root": root,
        "final_swing_mm": 1e3 * fraction * DEPTH,
        "largest_force_n": float(trace.force.max()),
    }
    return Outcome(
        figure(trace, "Fig. 7c: $K_o$ = 0.2 N/mm, $K_h$ = 0.22 N/mm"),
        table(trace),
        numbers,
        checks,
    )
