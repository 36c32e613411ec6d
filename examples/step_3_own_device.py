"""Step 3: a device of your own is any object with `read` and `write`.

python examples/step_3_own_device.py

This one is a wand that moves up and down by itself. Where it reads a clock and a sine, yours reads
hardware. The haptic loop makes it in its own process and calls it a thousand times a second.
"""

from __future__ import annotations

import math
import time

from cohaptic_client import DeviceInfo, DeviceSample, joined
from cohaptic_server import serve

Vector = tuple[float, float, float]


class Wand:
    """A tip above the balloon that dips 5 mm into it, once in two seconds."""

    # What it can do: the gains and the limits of the force rest on these.
    info = DeviceInfo("wand", max_force=5.0, max_stiffness=1000.0, damping=1.0, held=False)

    def __init__(self) -> None:
        self.start = -1.0

    def read(self, now: float) -> DeviceSample:
        """Return position and velocity of the tip at time `now` [s]."""
        if self.start < 0.0:
            self.start = now
        angle = math.pi * (now - self.start)
        height = 0.1 + 0.005 * math.cos(angle)
        return DeviceSample((0.0, 0.0, height), (0.0, 0.0, -0.005 * math.pi * math.sin(angle)))

    def write(self, force: Vector) -> None:
        """Give `force` [N] to the hand; a wand in the air has no motors."""

    def close(self) -> None:
        """Let the hardware go, if there is something to let go; this method may be missing."""


with serve("balloon", port=0) as room, joined(room.url, name="wand", device=Wand) as hand:
    for _ in range(8):
        time.sleep(0.5)
        print(f"height {1e3 * hand.tip[2]:5.1f} mm   force {hand.force[2]:5.2f} N")
