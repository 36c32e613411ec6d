"""Step 6: take every millisecond of a press, and draw it.

python examples/step_6_log_and_plot.py press.png

Two hands press on one balloon, in turn. `samples()` gives each haptic period once, a thousand in a
second; what a script is too slow for is counted, and never lost silently. (Needs matplotlib.)
"""

# pyright: reportUnknownMemberType=false
from __future__ import annotations

import asyncio
import sys

import numpy as np
from matplotlib import pyplot as plt

from cohaptic_client import LiveHand, join
from cohaptic_server import serve

SECONDS = 4.0


async def press(hand: LiveHand, side: float, begin: float) -> None:
    """Press 1 cm into the body at one side, one second long."""
    x, y, z = hand.body.center
    await asyncio.sleep(begin)
    hand.move_to((x + side * (hand.body.radius - 0.01), y, z), seconds=0.4)
    await asyncio.sleep(1.0)
    hand.move_to((x + side * (hand.body.radius + 0.01), y, z), seconds=0.4)


async def log(hand: LiveHand) -> np.ndarray:
    """Return time [s], force [N] and the part of it that the other causes [N], shape (n, 3)."""
    rows = list[tuple[float, float, float]]()
    async for sample in hand.samples():
        rows.append((sample.t, float(np.linalg.norm(sample.force)), sample.felt_from_others))
        if sample.t > rows[0][0] + SECONDS:
            break
    return np.array(rows) - [rows[0][0], 0.0, 0.0]


async def main(path: str) -> None:
    """Touch with two hands, and draw what each felt."""
    async with (
        serve("balloon", port=0) as room,
        join(room.url, name="ann", network="delay=40") as ann,
        join(room.url, name="bob", tip=(-0.13, 0.0, 0.0), network="delay=40") as bob,
    ):
        logs, *_ = await asyncio.gather(
            asyncio.gather(log(ann), log(bob)), press(ann, 1.0, 0.5), press(bob, -1.0, 1.0)
        )
    for name, rows in zip(("ann", "bob"), logs, strict=True):
        plt.plot(rows[:, 0], rows[:, 1], label=f"{name}, {len(rows)} samples")
    plt.xlabel("time [s]")
    plt.ylabel("force [N]")
    plt.legend()
    plt.savefig(path)
    print(f"{path}: {', '.join(str(len(rows)) for rows in logs)} samples")


asyncio.run(main(sys.argv[1] if len(sys.argv) > 1 else "press.png"))
