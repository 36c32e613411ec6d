"""Honest hands on links whose delays vary: nobody lies, and only the network is against them.

Hands move for a while and then rest. What their forces still do at rest is what the room makes.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cohaptic.simulated.delay_line import DelayLine, LinkSettings
from cohaptic.simulated.hand import Hand, HandScript
from cohaptic_client.devices.simulated import INFO
from cohaptic_experiments.attacks.victims import Moved
from cohaptic_experiments.partner_models.sessions import Moving, sines
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.room.body_frames import describe

LINKS: Final = ("jumps", "ramps", "long bursts", "bursts", "random", "repeats")
KINDS: Final = (*LINKS, "missed ticks", "all")
MOTIONS: Final = ("rest", "sway", "tap", "tremble")
_FASTEST, _SLOWEST = 0.005, 0.25  # s, the delays between which links vary
_BEGIN, _END = 2.5, 6.0  # s between which hands move
_REST: Final = 4.0  # s after which all has to be still
_LAST: Final = 1.5  # s thereafter in which a swing is looked for
_MISSED: Final = 0.4  # share of the ticks that a busy server misses
_DEPTH: Final = 0.008  # m
_DAMPING: Final = 1.0  # N s/m; of weak hands


class VaryingLine(DelayLine[bytes]):
    """A link whose delay is a function of the time.

    Args:
        delay: Delay of a message that is sent at a time [s].
        held: Messages wait for the end of such a time [s]; 0 for none.
        repeats: Share of the messages that come twice, the other time behind the next one.
        r: Source of chance.
    """

    def __init__(
        self, delay: Callable[[float], float], held: float, repeats: float, r: random.Random
    ) -> None:
        super().__init__(LinkSettings())
        self._delay, self._held, self._repeats, self._r = delay, held, repeats, r
        self._again: bytes | None = None

    def push(self, item: bytes, now: float) -> float:
        """Send `item` at `now` [s], and return the time at which it is due [s]."""
        due = now + self._delay(now)
        if self._held:
            due = max(due, (math.floor(now / self._held) + 1.0) * self._held)
        self._last_due = max(self._last_due, due)
        self._items.append((self._last_due, item))
        if self._again is not None:
            self._items.append((self._last_due, self._again))
            self._again = None
        elif self._r.random() < self._repeats:
            self._again = item
        return self._last_due


def varying(link: str, r: random.Random) -> VaryingLine:
    """Return one direction of a link of one of `LINKS`, or of one that pauses every few seconds."""
    phase, period = r.uniform(0.0, 2.0), r.choice([1.0, 1.0, 2.0])
    range_of = _SLOWEST - _FASTEST

    def jumps(t: float) -> float:
        return _FASTEST if int((t + phase) / period) % 2 == 0 else _SLOWEST

    def ramps(t: float) -> float:
        return _FASTEST + range_of * abs((t + phase) / period % 2.0 - 1.0)

    def by_chance(_: float) -> float:
        return r.uniform(_FASTEST, _SLOWEST)

    def usual(_: float) -> float:
        return r.uniform(0.02, 0.05) if link == "repeats" else 0.02

    pause, every = 0.0, 1.0
    if link == "pauses":  # drawn for these alone, so that rooms of a seed stay what they were
        pause, every = r.uniform(0.4, 0.7), r.uniform(2.0, 4.0)

    def pauses(t: float) -> float:
        return 0.02 + max(0.0, pause - (t + phase) % every)

    delay = {"jumps": jumps, "ramps": ramps, "random": by_chance, "pauses": pauses}.get(link, usual)
    held = {"bursts": 0.3, "long bursts": 0.9}.get(link, 0.0)
    return VaryingLine(delay, held, 0.4 if link == "repeats" else 0.0, r)


@dataclass(frozen=True, slots=True)
class Room:
    """A room on links that vary.

    Args:
        kind: One of `KINDS`, or "pauses"; with "all", each hand has a kind of link, and ticks are
            missed.
        hands: Number of hands.
        motion: One of `MOTIONS`.
        close: Whether hands stand 0.3 rad apart.
        seed: Seed of all draws.
    """

    kind: str
    hands: int
    motion: str
    close: bool
    seed: int


def draw(seed: int) -> Room:
    """Draw the room of a seed."""
    r = random.Random(seed)
    return Room(r.choice(KINDS), r.randrange(2, 5), r.choice(MOTIONS), r.random() < 0.5, seed)


class _Busy(VirtualSession):
    """A session whose server misses a share of its ticks, by chance."""

    def __init__(self, body: Balloon, fraction: float, r: random.Random) -> None:
        super().__init__(body)
        self._fraction, self._r = fraction, r

    def _tick(self) -> None:
        if self._r.random() < self._fraction:
            self._next_tick += self.room.settings.simulation_period
        else:
            super()._tick()


def still(room: Room, *, models: bool = True) -> float:
    """Play a room; return the largest change of a force after 4 s of rest [N]."""
    r, body = random.Random(room.seed), Balloon()
    misses = _MISSED if room.kind in ("missed ticks", "all") else 0.0
    session, info = _Busy(body, misses, r), describe(body)
    apart = 0.3 if room.close else 2.0 * math.pi / room.hands
    devices = list[Moved]()
    for k in range(room.hands):
        hand = Hand(r.uniform(0.05, 0.4), _DAMPING, 10.0 ** r.uniform(2.0, 2.9))
        script = HandScript((math.pi + k * apart) % (2.0 * math.pi), hand=hand)
        there = script.intention(info.center, info.radius)
        path = Moving(
            there.surface,
            there.direction,
            _DEPTH,
            approach_at=0.8,
            approach_time=0.5,
            waves=sines(room.motion, r.uniform),
            taps=r.uniform(2.0, 5.0) if room.motion == "tap" else 0.0,
            phase=r.random(),
            begin=_BEGIN,
            end=_END,
        )
        devices.append(Moved(hand, path, INFO))
        user = session.join(f"hand{k}", script, device=devices[-1], models=models, max_damping=0.0)
        link = r.choice(LINKS) if room.kind == "all" else room.kind
        user.up, user.down = varying(link, r), varying(link, r)
    session.run(_END + _REST + _LAST)
    last = round(_LAST * 1000)
    forces = [np.linalg.norm(np.array(d.track.forces[-last:]), axis=1) for d in devices]
    return max(float(np.ptp(force)) for force in forces)
