"""Lateness of the haptic loop, and the cost of a period.

    python benchmarks/loop.py [--seconds 5] [--json FILE]

The real loop with a simulated hand runs at 1 and 4 kHz, first in a process of its own, as in the
product, then as a thread of a process that also does a client's network work. A bare loop that only
sleeps runs for the same time before each, as a measure of the machine's scheduler. Timings depend
on the machine and its load; compare within one run.
"""

from __future__ import annotations

import json
import math
import threading
import time

import json_report
from cohaptic.clock import SystemClock
from cohaptic.control.law import Law, LawSettings
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.simulated.hand import Hand, HandScript, Rhythm
from cohaptic.status.quantiles import Tally
from cohaptic_client.devices.device_config import DeviceConfig
from cohaptic_client.devices.simulated import SimulatedDevice
from cohaptic_client.loop.config import LoopConfig, silent_after
from cohaptic_client.loop.handle import HapticProcess
from cohaptic_client.loop.memory import LoopMemory
from cohaptic_client.loop.passivity import MAX_DAMPING
from cohaptic_client.loop.process import COMMAND, HapticLoop
from cohaptic_client.loop.safety import SafetyLimits

TICK = 1.0 / 60.0  # s
FIGURES = ("late_p50", "late_p99", "cost_p50", "missed")


def bare(hz: float, seconds: float) -> Tally:
    """Lateness of a loop that does nothing but sleep."""
    clock, late = SystemClock(), Tally()
    due = clock.now()
    for _ in range(round(seconds * hz)):
        due += 1.0 / hz
        clock.sleep_until(due)
        late.add(max(0.0, clock.now() - due))
        due = max(due, clock.now() - 1.0 / hz)
    return late


def config(hz: float, clock: SystemClock, memory: LoopMemory) -> LoopConfig:
    """A hand that presses and releases on a plane."""
    script = HandScript(angle=0.0, depth=0.01, rhythm=Rhythm(1.0))
    return LoopConfig(
        memory=memory.path,
        clock_origin=clock.origin,
        haptic_period=1.0 / hz,
        simulation_period=TICK,
        law=LawSettings(),
        smoothing=1.0,
        max_damping=MAX_DAMPING,
        friction=0.0,
        follow=True,
        device=DeviceConfig(
            "simulated",
            (0.0, 0.0, 0.0),
            0.1,
            Hand(),
            script.intention((0.0, 0.0, 0.0), 0.1),
        ),
        limits=SafetyLimits(silent_after=silent_after(TICK)),
    )


def patch(tick: int) -> bytes:
    """A plane that moves a little from tick to tick."""
    lift = 0.002 * math.sin(0.1 * tick)
    return Patch(
        tick=tick, seq=0, t_server=0.0, t_client=0.0, sample_wait=0.0, geometry=Geometry.PLANE,
        law=Law.PREDICTIVE,
        x_free=(0.1 + lift, 0.0, 0.0), normal=(1.0, 0.0, 0.0), curvature=0.0,
        c_ii=0.004, k_h=250.0, integral_gain=0.0, own_force=(0.0, 0.0, 0.0),
        u_others=(lift, 0.0, 0.0),
    ).encode()  # fmt: skip


def own_process(hz: float, seconds: float) -> dict[str, float]:
    """The loop as in the product; patches come at 60 Hz."""
    clock, memory = SystemClock(), LoopMemory.create()
    process = HapticProcess(config(hz, clock, memory), memory)
    for tick in range(1, round(seconds / TICK)):
        process.give_patch(patch(tick))
        process.beat()
        process.new_rows()
        time.sleep(TICK)
    process.request_stop()
    process.wait()
    process.read_status()
    memory.close(remove=True)
    return {name: float(str(process.status[name])) for name in FIGURES}


def thread(hz: float, seconds: float) -> dict[str, float]:
    """The same loop as a thread beside a client's network work in Python."""
    clock, memory = SystemClock(), LoopMemory.create()
    setting = config(hz, clock, memory)
    assert setting.device.intention is not None
    loop = HapticLoop(
        setting,
        LoopMemory(memory.path),
        SimulatedDevice(setting.device.hand, setting.device.intention),
        prefer=False,
    )
    runner = threading.Thread(target=loop.run)
    runner.start()
    for tick in range(1, round(seconds / TICK)):
        memory.patch.write(patch(tick))
        memory.command.write(COMMAND.pack(tick, False))
        for row in memory.rows.read_new():
            json.dumps(row)
        time.sleep(TICK)
    memory.command.write(COMMAND.pack(0, True))
    runner.join()
    s = loop.statistics
    return {
        "late_p50": s.late.quantile(0.5),
        "late_p99": s.late.quantile(0.99),
        "cost_p50": s.cost.quantile(0.5),
        "missed": s.missed,
    }


def main() -> None:
    """Print a table."""
    parser = json_report.parser(__doc__)
    parser.add_argument("--seconds", type=float, default=5.0, help="of each row")
    options = parser.parse_args()
    seconds = options.seconds
    results: list[json_report.Result] = []
    print("| loop | rate | late p50 | late p99 | cost of a period | left out | p99 / bare p99 |")
    print("|---|---|---|---|---|---|---|")
    for hz in (1000.0, 4000.0):
        floor = bare(hz, seconds)
        rows = {
            "own process": own_process(hz, seconds),
            "thread beside the network": thread(hz, seconds),
        }
        print(
            f"| bare sleep | {hz:.0f} Hz | {1e6 * floor.quantile(0.5):.0f} us"
            f" | {1e6 * floor.quantile(0.99):.0f} us | | | 1 |"
        )
        bare_p99 = max(1e-9, floor.quantile(0.99))
        results.append(
            {
                "loop": "bare sleep",
                "rate_hz": hz,
                "late_p50_s": floor.quantile(0.5),
                "late_p99_s": floor.quantile(0.99),
            }
        )
        for name, row in rows.items():
            results.append(
                {
                    "loop": name,
                    "rate_hz": hz,
                    "late_p50_s": row["late_p50"],
                    "late_p99_s": row["late_p99"],
                    "cost_p50_s": row["cost_p50"],
                    "left_out": row["missed"] / (hz * seconds),
                    "late_p99_over_bare": row["late_p99"] / bare_p99,
                }
            )
            print(
                f"| {name} | {hz:.0f} Hz"
                f" | {1e6 * row['late_p50']:.0f} us | {1e6 * row['late_p99']:.0f} us"
                f" | {1e6 * row['cost_p50']:.0f} us | {row['missed'] / (hz * seconds):.2%}"
                f" | {row['late_p99'] / bare_p99:.1f} |"
            )
    json_report.write(options, results)


if __name__ == "__main__":
    main()
