"""Measures how late empty periods start on this machine, and which priority the system grants.

python -m cohaptic_client.loop.running.measure SECONDS

The process is scheduled and compiled like that of the haptic loop; its last line is JSON.
"""

from __future__ import annotations

import gc
import json
import sys
from typing import Any, Final

from cohaptic import compiled

PERIOD: Final = 0.001  # s; the loop's by default, 1 kHz


def measure(seconds: float) -> dict[str, Any]:
    """Run empty periods for `seconds` [s] and measure how late they start.

    Returns:
        Granted scheduling and memory lock, in words; kind of the modules; quantiles of the lateness
        [s]; share of the periods that were late by more than a period.
    """
    compiled.use("loop")
    # Imported only now, because a module that was imported before `use` stays interpreted.
    from cohaptic.clock import SystemClock
    from cohaptic.runtime.scheduling import LOOP_PRIORITY, lock_memory, prefer_this_process
    from cohaptic.status.quantiles import Tally

    scheduling, memory = prefer_this_process(LOOP_PRIORITY), lock_memory()
    gc.collect()
    gc.freeze()
    gc.disable()
    clock, late, very = SystemClock(), Tally(), 0
    due = clock.now()
    end = due + seconds
    while due < end:
        due += PERIOD
        clock.sleep_until(due)
        behind = max(0.0, clock.now() - due)
        late.add(behind)
        if behind > PERIOD:
            very += 1
            due += PERIOD * int(behind / PERIOD)
    return {
        "scheduling": scheduling,
        "memory": memory,
        "compiled": compiled.describe("loop"),
        "periods": late.count,
        "late_p50": late.quantile(0.5),
        "late_p99": late.quantile(0.99),
        "late_most": late.largest,
        "late_by_a_period": very / max(1, late.count),
    }


if __name__ == "__main__":
    print(json.dumps(measure(float(sys.argv[1]))))
