"""Two users on the balloon with each preset of the simulated device, at several delays.

    python benchmarks/presets.py

Virtual time; room, world, frames, links, loops and safety layers are the product's. The damping
budget is the one that the preset has: Colgate's bound on its own damping and stiffness. Both hands
rest pressed; the swing is the largest less the least force over the last second.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
import typer

from cohaptic import compiled

compiled.use("loop")

from cohaptic.simulated.hand import Hand, HandScript  # noqa: E402  # compiled before it is imported
from cohaptic_client.devices.simulated import PRESETS, SimulatedDevice  # noqa: E402
from cohaptic_client.loop.passivity import device_damping_limit  # noqa: E402
from cohaptic_client.loop.safety import SafetyLimits, rate_of  # noqa: E402
from cohaptic_experiments.virtual_session import PERIOD, VirtualSession, VirtualUser  # noqa: E402
from cohaptic_server.bodies.balloon.balloon import Balloon  # noqa: E402
from cohaptic_server.room.body_frames import describe  # noqa: E402

DELAYS = (0.0, 0.08, 0.25)  # s, one way
HANDS = {"firm": Hand(), "light": Hand(mass=0.05, damping=1.0)}


def swing(name: str, delay: float, hand: Hand, depth: float, seconds: float) -> tuple[float, float]:
    """Swing of the force over the last second, and its mean [N], of the worse of two users."""
    info = PRESETS[name]
    budget = device_damping_limit(info.damping, info.max_stiffness, PERIOD)
    session = VirtualSession(Balloon())
    body = describe(session.room.body)
    limits = SafetyLimits(max_force=info.max_force, max_rate=rate_of(info.max_stiffness))
    users = list[VirtualUser]()
    for k, angle in enumerate((math.pi, 0.0)):
        script = HandScript(angle=angle, depth=depth, approach_at=1.0 + 2.0 * delay, hand=hand)
        device = SimulatedDevice(hand, script.intention(body.center, body.radius), info)
        users.append(
            session.join(
                f"user {k}", script, delay=delay, seed=k, device=device, max_damping=budget,
                limits=limits,
            )
        )  # fmt: skip
    session.run(seconds)
    force = np.array([user.force[-round(1.0 / PERIOD) :] for user in users])
    return float(np.ptp(force, axis=1).max()), float(force.mean())


def main(
    depth_mm: Annotated[float, typer.Option()] = 10.0,
    seconds: Annotated[float, typer.Option()] = 8.0,
) -> None:
    """Print a table of the swings [N] in Markdown."""
    print("| preset | hand | " + " | ".join(f"{1e3 * d:.0f} ms" for d in DELAYS) + " |")
    print("| --- " * (2 + len(DELAYS)) + "|")
    for name in PRESETS:
        for words, hand in HANDS.items():
            cells = [swing(name, delay, hand, 1e-3 * depth_mm, seconds) for delay in DELAYS]
            listed = " | ".join(f"{s:.3f} of {mean:.2f} N" for s, mean in cells)
            print(f"| {name} | {words} | {listed} |", flush=True)


if __name__ == "__main__":
    typer.run(main)
