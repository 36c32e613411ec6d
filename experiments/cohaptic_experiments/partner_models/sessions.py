"""Random rooms in whole sessions: hands that rest, sway, tap or tremble, and then rest again.

`python -m cohaptic_experiments.partner_models.sessions` plays rooms of the program in virtual time,
with clients that move models of each other. A room swings if a force still changes by more than
`SWINGS` at the end, when all hands have been still for seconds. Hands of less than 1 N s/m, close
to each other and on devices that damp nothing are the hard ones: `--least-damping 0.3 --close`.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.hand import Hand, HandScript, Intention, ease
from cohaptic.vec import Vec3, add, scale
from cohaptic_client.devices.simulated import INFO, SimulatedDevice
from cohaptic_experiments.transparency.product import Product, Variant
from cohaptic_experiments.transparency.scheme import SchemeSession
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.room.body_frames import describe

KINDS: Final = ("rest", "sway", "tap", "in step", "tremble")
DELAYS: Final = (0.0, 0.08, 0.25)  # s, each way
SWINGS: Final = 0.05  # N
_BEGIN, _END = 4.0, 12.0  # s between which hands move
_STILL = 6.0  # s of rest at the end
_LAST = 1.5  # s of it in which a swing is looked for
_DEPTH = 0.008  # m
_JITTER = 0.02  # s
# Amplitude [m] and range of frequencies [Hz] of the sines of each kind.
_WAVES: Final = {
    "rest": (),
    "sway": ((3e-3, 0.3, 1.0), (1e-3, 1.0, 3.0)),
    "tap": (),
    "in step": (),
    "tremble": ((0.3e-3, 6.0, 12.0), (0.3e-3, 6.0, 12.0), (1e-3, 0.3, 1.0)),
}
_TAP = 8e-3  # m
Sine = tuple[float, float, float]  # frequency [Hz], amplitude [m] and phase [rad]
_OF_PAGE: Final = (Hand(), Hand(0.15, 60.0, 1e4))  # `HANDS` of web/src/page/own_hand.ts


@dataclass(frozen=True, slots=True)
class Moving(Intention):
    """Intention that rests at its depth, moves for a while, and rests again.

    Args:
        waves: Sines that are added.
        taps: Taps per second; 0 for none.
        phase: Share of a tap's period at which the first one begins.
        begin, end: Times between which it moves [s].
    """

    waves: tuple[Sine, ...] = ()
    taps: float = 0.0
    phase: float = 0.0
    begin: float = field(default_factory=lambda: _BEGIN)
    end: float = field(default_factory=lambda: _END)

    def position(self, t: float) -> Vec3:
        """Return the intended position [m] of the tip at the time `t` [s]."""
        tip = Intention.position(self, t)
        much = ease((t - self.begin) / 0.5) * (1.0 - ease((t - self.end) / 0.5))
        if much <= 0.0:
            return tip
        deeper = sum(a * math.sin(2.0 * math.pi * f * t + p) for f, a, p in self.waves)
        if self.taps > 0.0:
            u = (self.taps * t + self.phase) % 1.0
            deeper -= _TAP * (1.0 - (ease(u / 0.2) if u < 0.5 else 1.0 - ease((u - 0.5) / 0.2)))
        return add(tip, scale(self.direction, much * deeper))


def sines(kind: str, uniform: Callable[[float, float], float]) -> tuple[Sine, ...]:
    """Draw the sines of a kind of motion, with a draw that is uniform between two values."""
    return tuple(
        (float(uniform(low, high)), a, float(uniform(0.0, 2.0 * math.pi)))
        for a, low, high in _WAVES[kind]
    )


@dataclass(frozen=True, slots=True)
class Ensemble:
    """How rooms are drawn.

    Args:
        kinds: Motions of which one is drawn for each room.
        least_damping: Least damping of a hand [N s/m]; the largest is 10 N s/m.
        close: Whether hands stand side by side, down to 0.15 rad apart.
        budget: Damping that each device may render [N s/m].
        models: Whether clients move models.
        pages: Number of clients in each room, one less than all at most, that do not and tell their
            hand, as the page does: one of the page's two.
        seed: Seed of all draws.
    """

    kinds: tuple[str, ...] = KINDS
    least_damping: float = 1.0
    close: bool = False
    budget: float = 0.0
    models: bool = True
    pages: int = 0
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Room:
    """Outcome of one room.

    Args:
        kind: Motion of the hands.
        delay: Delay, each way [s].
        hands: Mass [kg], damping [N s/m] and stiffness [N/m] of each hand.
        span: Largest change of each force at the end [N].
        before: The same 2 s earlier [N].
        jumps: Largest change of each force in a period that the hand's own motion does not explain
            [N].
        lags: Lag of each hand at the end [s].
    """

    kind: str
    delay: float
    hands: tuple[tuple[float, float, float], ...]
    span: tuple[float, ...]
    before: tuple[float, ...]
    jumps: tuple[float, ...]
    lags: tuple[float, ...]

    @property
    def swings(self) -> bool:
        """Whether a force still swings at the end."""
        return not max(self.span) <= SWINGS

    @property
    def grows(self) -> bool:
        """Whether it swings more than before."""
        return any(a > max(SWINGS, 1.05 * b) for a, b in zip(self.span, self.before, strict=True))


def play(ensemble: Ensemble, number: int) -> Room:
    """Draw and play the room of a number."""
    rng = np.random.default_rng((ensemble.seed, number))
    n, delay = int(rng.integers(2, 5)), float(rng.choice(DELAYS))
    kind = str(rng.choice(ensemble.kinds))
    hands = [
        Hand(
            float(rng.uniform(0.05, 0.5)),
            float(np.exp(rng.uniform(math.log(ensemble.least_damping), math.log(10.0)))),
            float(10.0 ** rng.uniform(2.0, 3.0)),
        )
        for _ in range(n)
    ]
    apart = float(rng.uniform(0.15, 1.0)) if ensemble.close else 2.0 * math.pi / n
    body, plans = Balloon(), list[Moving]()
    info = describe(body)
    taps = float(rng.uniform(2.0, 5.0))
    for i in range(n):
        usual = HandScript((math.pi + i * apart) % (2.0 * math.pi)).intention(
            info.center, info.radius
        )
        waves = sines(kind, rng.uniform)
        rate = {"tap": float(rng.uniform(2.0, 5.0)), "in step": taps}.get(kind, 0.0)
        plans.append(
            Moving(
                usual.surface, usual.direction, _DEPTH, approach_at=1.5 + 2.2 * delay,
                approach_time=0.5, waves=waves, taps=rate,
                phase=float(rng.random()) if kind == "tap" else 0.0,
            )
        )  # fmt: skip
    layer = ensemble.budget > 0.0
    pages = min(n - 1, ensemble.pages)
    reported = tuple(_OF_PAGE[int(rng.integers(0, len(_OF_PAGE)))] for _ in range(pages))
    hands[n - pages :] = reported
    product = Product(
        body, n,
        Variant(budget=ensemble.budget, layer=layer, models=ensemble.models, pages=reported),
    )  # fmt: skip
    devices = [SimulatedDevice(hand, plan, INFO) for hand, plan in zip(hands, plans, strict=True)]
    link = LinkSettings(delay, _JITTER if delay else 0.0, number)
    _, force = SchemeSession(product, devices, link).run(_END + _STILL)
    last, ago = round(_LAST * 1000), round((_LAST + 2.0) * 1000)
    wishes = product.room.world.wishes
    return Room(
        kind, delay, tuple((h.mass, h.damping, h.stiffness) for h in hands),
        tuple(np.ptp(force[:, -last:], axis=1).tolist()),
        tuple(np.ptp(force[:, -ago : last - ago], axis=1).tolist()),
        tuple(max(user.unexplained) for user in product.users),
        tuple(hand.lag for hand in wishes.hands.values()),
    )  # fmt: skip


def _line(name: str, rooms: Sequence[Room]) -> str:
    swing, grow = sum(room.swings for room in rooms), sum(room.grows for room in rooms)
    lags = [1e3 * lag for room in rooms for lag in room.lags] or [0.0]
    return (
        f"{name:22s} {len(rooms):5d} rooms: {swing} swing, {grow} grow; largest step "
        f"{max(max(room.jumps) for room in rooms):.4f} N/ms; lag median {np.median(lags):.0f}, "
        f"90 % {np.quantile(lags, 0.9):.0f} ms"
    )


def _main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rooms", type=int, default=60)
    parser.add_argument("--kinds", nargs="*", choices=KINDS, default=list(KINDS))
    parser.add_argument("--least-damping", type=float, default=1.0, help="N s/m")
    parser.add_argument("--close", action="store_true", help="hands side by side")
    parser.add_argument("--budget", type=float, default=0.0, help="of each device, N s/m")
    parser.add_argument("--no-models", action="store_true", help="as without models")
    parser.add_argument("--pages", type=int, default=0, help="clients that tell their hand")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--json", type=Path)
    a = parser.parse_args()
    ensemble = Ensemble(
        tuple(a.kinds), a.least_damping, a.close, a.budget, not a.no_models, a.pages, a.seed
    )
    rooms: list[Room] = []
    with ProcessPoolExecutor(a.workers) as pool:
        for k, room in enumerate(pool.map(partial(play, ensemble), range(a.rooms))):
            rooms.append(room)
            print(f"\r{k + 1} of {a.rooms} rooms", end="", file=sys.stderr, flush=True)
            if room.swings:
                print(k, room, flush=True)
    print(file=sys.stderr)
    for kind in KINDS:
        if some := [room for room in rooms if room.kind == kind]:
            print(_line(kind, some))
    print(_line("all", rooms))
    if a.json is not None:
        a.json.write_text(json.dumps([room.__getstate__() for room in rooms]), encoding="utf-8")


if __name__ == "__main__":
    _main()
