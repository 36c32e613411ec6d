"""Step 7: two hands in virtual time: no server, no clock, the same numbers each time.

python examples/step_7_two_hands_in_virtual_time.py

`left` presses in a rhythm, and `right` rests at the other side. How well does `right` feel `left`,
over networks that are ever worse?
"""

from __future__ import annotations

import math

import numpy as np

from cohaptic import HandScript, Rhythm
from cohaptic_experiments import VirtualSession
from cohaptic_server import Balloon


def play(network: str, seconds: float = 6.0) -> tuple[float, float]:
    """Return how much of the other's touch came [N], and the largest step of the force [N/ms]."""
    session = VirtualSession(Balloon())
    press = HandScript(angle=math.pi, rhythm=Rhythm(2.0))
    session.join("left", press, network=network, models=True, seed=1)
    right = session.join("right", HandScript(angle=0.0), network=network, models=True, seed=2)
    session.run(seconds)
    felt = np.array(right.felt[3000:])  # after the first touches
    step = float(np.abs(np.diff(right.force)).max())
    return float(felt.max() - felt.min()), step


for words in ("", "transatlantic", "wifi"):
    swing, step = play(words)
    print(f"{words or 'no network':>14}: {swing:.2f} N of the other, steps up to {step:.4f} N/ms")
