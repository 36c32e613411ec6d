"""Ways round the network that two hands on one pinched limb take to come to rest (science 3.13).

    python benchmarks/pinched_limbs.py [--json FILE]

A limb between two hands is stiffer for both together than for each: the eigenvalue -m of S is close
to -1. The hands are springs without a mass, which answer to the share 1 / (1 + h) of what the other
one does, h being K over their own stiffness; 1 is a clamp. Each has its own delay, and the room has
no lag. The step is the product's (`anticipated`) with another *kappa*, and as a second way to be
quicker with *momentum*: a share of what the own force has changed in the last way round is added.

Told are the ways round of the slower hand until both forces are within 2 % of what they will be,
and stay there, at most 150; *swings* is a room in which they move away from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

import json_report
from cohaptic.control.stability.anticipation import LEAST_KAPPA, anticipated

COUPLINGS = (0.87, 0.985)  # an organ's lobe, an animal's leg
ANSWERS = {"clamps": 1.0, "firm": 0.9, "soft": 0.5, "limp": 0.05}
DELAYS = ((30, 30), (30, 17), (30, 5))  # ticks round the network
STEPS = ((LEAST_KAPPA, 0.0), (1.0, 0.0), (0.3, 0.0), (0.0, 0.0), (LEAST_KAPPA, 0.3),
         (LEAST_KAPPA, 0.6))  # kappa and momentum  # fmt: skip
WITHIN = 0.02
LARGEST = 150  # ways round that are tried
PULL = np.array([1.0, 0.7])  # of the forces of both hands on a surface that is held [1]


@dataclass(frozen=True, slots=True)
class Room:
    """Two hands on a limb.

    Args:
        m: Modulus of the negative eigenvalue of S, below 1.
        answers: Share of what the other one does that each hand answers, from 0 to 1.
        delays: Delays of each round the network, in ticks.
    """

    m: float
    answers: tuple[float, float]
    delays: tuple[int, int]


def ways_to_rest(room: Room, kappa: float, momentum: float) -> float:
    """Ways round of the slower hand until both forces are steady.

    It is `LARGEST` where they are not by then, and inf where they move away from what would be
    steady.

    Args:
        room: Room of two hands.
        kappa: kappa of `anticipated`, at least 0.
        momentum: Share of the change of the last way round that is added.
    """
    S = np.array([[0.0, -room.m], [-room.m, 0.0]])
    part = anticipated(S, kappa)
    y = np.array(room.answers, dtype=np.float64)
    rest = np.linalg.solve(np.eye(2) + y[:, None] * S, y * PULL)
    slower = max(room.delays)
    u = np.zeros((2 * slower + LARGEST * slower, 2))
    for k in range(2 * slower, len(u)):
        before, earlier = (u[k - times * np.array(room.delays)] for times in (1, 2))
        step = part.solve @ (y * (PULL - (S * before).sum(axis=1)) + (part.X * before).sum(axis=1))
        own = np.diagonal(before) - np.diagonal(earlier)
        u[k] = np.clip(step + momentum * own, -1e6, 1e6)
    off = np.abs(u[2 * slower :] - rest).max(axis=1) / np.abs(rest).max()
    if off[-slower:].max() > max(WITHIN, off[:slower].max()):
        return float("inf")
    far = np.flatnonzero(off > WITHIN)
    return (int(far[-1]) + 1) / slower if len(far) else 0.0


def worst(m: float, answers: tuple[float, float], kappa: float, momentum: float) -> float:
    """The same of the slowest of all delays."""
    return max(ways_to_rest(Room(m, answers, delays), kappa, momentum) for delays in DELAYS)


def pairs() -> dict[str, tuple[float, float]]:
    """Both hands alike, and a clamp beside a limp one."""
    alike = {name: (fraction, fraction) for name, fraction in ANSWERS.items()}
    return alike | {"clamp and limp": (ANSWERS["clamps"], ANSWERS["limp"])}


def main() -> None:
    """Print the table."""
    options = json_report.parser(__doc__).parse_args()
    hands = pairs()
    print(f"ways round to {WITHIN:.0%}, the worst of delays of {DELAYS} ticks")
    print(f"{'m':>6} {'kappa':>6} {'momentum':>8}", *(f"{name:>14}" for name in hands))
    results: list[json_report.Result] = []
    for m, (kappa, momentum) in product(COUPLINGS, STEPS):
        ways = {name: worst(m, answers, kappa, momentum) for name, answers in hands.items()}
        reported = ("swings" if n == np.inf else f"{n:.0f}" for n in ways.values())
        print(f"{m:6g} {kappa:6g} {momentum:8g}", *(f"{each:>14}" for each in reported), flush=True)
        results.append({"m": m, "kappa": kappa, "momentum": momentum, **ways})
    json_report.write(options, results)


if __name__ == "__main__":
    main()
