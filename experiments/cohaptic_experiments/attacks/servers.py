"""Servers that lie in every field of the hands that a patch tells, against one client's loop.

A server has three states, a warm-up and two that it takes in turn. The hand presses before, with an
honest partner; then it rests, or moves on as it is told.
"""

from __future__ import annotations

import copy
import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Final

from cohaptic.control.hand_model import USUAL_HAND, HandModel
from cohaptic.control.law import Law
from cohaptic.protocol.partners import HEAVIEST, LIGHTEST, Partner, Partners
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.vec import ZERO, Vec3, norm, scale, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.safety import SafetyLimits, rate_of
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.step import step
from cohaptic_experiments.attacks.victims import PERIOD

DEVICES: Final = ((400.0, 3.3), (2000.0, 10.0), (8000.0, 12.0))  # N/m, N
_SOFT: Final = 1.0 / 250.0  # m/N, of the object that a server tells
_TICK: Final = 16  # periods from patch to patch of an honest server
_SPAN: Final = 20  # ms
_PLANE: Final = Patch(
    tick=1, seq=0, t_server=0.0, t_client=0.0, sample_wait=0.0, geometry=Geometry.PLANE,
    law=Law.PREDICTIVE, x_free=ZERO, normal=(0.0, 0.0, 1.0), curvature=0.0, c_ii=_SOFT,
    k_h=1.0 / _SOFT, integral_gain=0.0, own_force=ZERO, u_others=ZERO,
)  # fmt: skip


@dataclass(frozen=True)
class Server:
    """A hostile server.

    Args:
        a, b, warm: Its patches: two in turn, and the one of its first periods.
        turn: What it takes its turns from: "clock", "velocity" or "against".
        half: Periods until the next turn, by the clock.
        each: Periods from patch to patch.
        warms: Periods in which it sends `warm`.
    """

    a: Patch
    b: Patch
    warm: Patch
    turn: str
    half: int
    each: int
    warms: int


def _partner(r: random.Random, user: int, earlier: int) -> Partner:
    def between(low: float, high: float) -> float:
        return math.exp(r.uniform(math.log(low), math.log(high)))

    drawn = HandModel(between(0.03, 0.8), between(0.5, 100.0), between(50.0, 1e4))
    coupled = [
        _SOFT * r.choice([0.0, 0.3, 0.9, -0.9, 0.999, -0.999, 3.0, 100.0, r.uniform(-1.0, 1.0)])
        for _ in range(earlier + 1)
    ]
    return Partner(
        user,
        r.choice([LIGHTEST, LIGHTEST, HEAVIEST, USUAL_HAND, drawn]),
        intended=r.choice([-20.0, -0.02, -0.01, 0.0, 0.005, 0.01, 0.02, 0.1, 20.0]),
        deflection=r.choice([0.0, 0.0, 0.01, -0.01, -10.0, 10.0]),
        force=r.choice([0.0, 0.0, 2.0, 10.0, 300.0]),
        max_force=r.choice([0.0, 1.0, 10.0, 100.0]),
        c_jj=r.choice([_SOFT, _SOFT, 1e-6, 1e-4, 10.0]),
        coupled=tuple(coupled),
    )


def _patch(r: random.Random) -> Patch:
    users = range(2, 2 + r.choice([1, 1, 1, 2, 3]))
    partners = Partners(
        weight=r.choice([0.0, 0.5, 1.0, 1.0, 1.0]),
        max_force=r.choice([0.0, 10.0, 10.0, 10.0]),
        model=r.choice([LIGHTEST, HEAVIEST, USUAL_HAND]),
        partners=tuple(_partner(r, user, j) for j, user in enumerate(users)),
    )
    return replace(
        _PLANE,
        x_free=(0.0, 0.0, r.choice([0.0, 0.0, 0.0, 0.002, -0.002, 0.02, -0.02, 5.0, -5.0])),
        c_ii=r.choice([_SOFT, _SOFT, _SOFT, 1e-6, 1e-3, 10.0]),
        k_h=r.choice([250.0, 250.0, 250.0, 2000.0, 1e6]),
        normal=r.choice([(0.0, 0.0, 1.0)] * 6 + [(0.0, 0.0, -1.0), (0.8, 0.0, 0.6)]),
        own_force=(0.0, 0.0, r.choice([0.0, 0.0, 2.0, 10.0])),
        partners=None if r.random() < 0.05 else partners,
    )


def _let_loose(r: random.Random) -> Server:
    """Return a server that lets a light hand loose on a stiff contact, and catches it, in turn."""
    coupled = _SOFT * r.choice([0.05, 0.135, 0.3])
    hand = Partner(2, LIGHTEST, 0.1, 0.0, 0.0, 100.0, 1e-4, (coupled,))
    pressing = Partners(1.0, 10.0, USUAL_HAND, (hand,))
    gone = Partners(1.0, 10.0, USUAL_HAND, (hand._replace(intended=-0.1, max_force=0.0),))
    a, b = replace(_PLANE, partners=pressing), replace(_PLANE, partners=gone)
    return Server(a, b, a, "clock", half=r.choice([10, 20, 40]), each=1, warms=0)


def draw(r: random.Random) -> Server:
    """Draw a server."""
    if r.random() < 0.2:
        return _let_loose(r)
    return Server(
        a=_patch(r),
        b=_patch(r),
        warm=_patch(r),
        turn=r.choice(["clock", "clock", "velocity", "against"]),
        half=r.choice([1, 2, 4, 8, 16, 16, 32, 60, r.randrange(1, 120)]),
        each=r.choice([1, 2, 4, 16, 16]),
        warms=r.choice([0, 0, 300]),
    )


def alter(server: Server, r: random.Random) -> Server:
    """Change one thing about a server; its patches are changed more often."""
    other, name = draw(r), r.choice([*vars(server), "a", "b", "a", "b"])
    changed: Any = getattr(other, name)
    if name in ("a", "b", "warm"):
        changed = _altered(getattr(server, name), r)
    return replace(server, **{name: changed})


def _altered(patch: Patch, r: random.Random) -> Patch:
    """Change one thing about a patch; its partners are changed more often."""
    part = r.choice(["x_free", "c_ii", "k_h", "normal", "own_force", "partners"])
    changed: Any = getattr(_patch(r), part)
    news = patch.partners
    if news is not None and news.partners and r.random() < 0.6:
        j, part = r.randrange(len(news.partners)), "partners"
        field_of = r.choice(
            ["model", "intended", "deflection", "force", "max_force", "c_jj", "coupled"]
        )
        value: Any = getattr(_partner(r, news.partners[j].user, j), field_of)
        one = news.partners[j]._replace(**{field_of: value})
        others = (*news.partners[:j], one, *news.partners[j + 1 :])
        changed = Partners(news.weight, news.max_force, news.model, others)
    return replace(patch, **{part: changed})


Way = Callable[[int], Vec3]  # displacement of the tip in a period [m]


def _tremble(n: int) -> float:
    return 1e-4 * (math.sin(0.02 * math.pi * (n + 1)) - math.sin(0.02 * math.pi * n))


WAYS: Final[dict[str, Way]] = {
    "still": lambda _: ZERO,
    "creeps at 5 mm/s": lambda n: (0.0, 0.0, -5e-6 if n // 1000 % 2 == 0 else 5e-6),
    "trembles by 0.1 mm at 10 Hz": lambda n: (0.0, 0.0, _tremble(n)),
    "slides at 50 mm/s": lambda n: (5e-5 if n // 400 % 2 == 0 else -5e-5, 0.0, 0.0),
}


@dataclass
class Attacked:
    """A hand on a device, with its tip on rails, and its loop.

    Args:
        stiffness, max_force: Of the device [N/m, N].
        damping: Damping that the device renders [N s/m].
        object_stiffness: Of the honest server's object [N/m].
    """

    stiffness: float
    max_force: float
    damping: float = 0.0
    object_stiffness: float = 250.0
    state: LoopState = field(default_factory=LoopState)
    now: float = 100.0
    ticks: int = 0
    at: Vec3 = (0.0, 0.0, 0.003)
    inwards: float = 0.0
    forces: list[Vec3] = field(default_factory=list[Vec3])

    def __post_init__(self) -> None:
        limits = SafetyLimits(
            max_force=self.max_force, max_rate=rate_of(self.stiffness), engage_time=0.02
        )
        self.settings = LoopSettings(
            1.0 / 60.0,
            limits,
            max_damping=self.damping,
            max_stiffness=self.stiffness,
        )
        soft = 1.0 / self.object_stiffness
        partner = Partner(2, USUAL_HAND, 0.005, 0.0, 0.0, 10.0, soft, (0.3 * soft,))
        self.honest = replace(
            _PLANE,
            c_ii=soft,
            k_h=min(self.object_stiffness, self.stiffness),
            partners=Partners(1.0, 10.0, USUAL_HAND, (partner,)),
        )

    def take(self, patch: Patch) -> None:
        """A patch comes."""
        self.ticks += 1
        self.state = receive(self.state, replace(patch, tick=self.ticks), self.now, self.settings)

    def period(self, way: Vec3) -> None:
        """A period in which the tip moves so far [m]."""
        self.now += PERIOD
        self.at = (self.at[0] + way[0], self.at[1] + way[1], self.at[2] + way[2])
        self.inwards = -way[2]
        sample = DeviceSample(self.at, scale(way, 1.0 / PERIOD))
        self.state, output = step(self.state, sample, self.now, self.settings)
        self.forces.append(output.force)

    def press(self, speed: float, depth: float = 0.004) -> None:
        """Engage in front of the object, press to a depth [m] at a speed [m/s], and stop."""
        start, n = 0.003 + 0.06 * speed, 0
        while n < 200 or self.at[2] > -depth:
            if n % _TICK == 0:
                self.take(self.honest)
            away = min(1e-4, start - self.at[2]) if n < 200 else 0.0
            inwards = min(self.at[2] + depth, speed * PERIOD * min(1.0, (n - 199) / 20.0))
            self.period((0.0, 0.0, away if n < 200 else -inwards))
            n += 1

    def rest(self, periods: int) -> None:
        """Rest on the honest server's object."""
        for n in range(periods):
            if n % _TICK == 0:
                self.take(self.honest)
            self.period(ZERO)

    def suffer(self, server: Server, periods: int, way: Way) -> tuple[float, float]:
        """Return the largest change of the force in 1 ms and in 20 ms under an attack [N]."""
        first = len(self.forces)
        for n in range(periods):
            if n % server.each == 0:
                turn = n // server.half % 2 == 0
                if server.turn != "clock":
                    turn = (self.inwards > 0.0) == (server.turn == "velocity")
                self.take(server.warm if n < server.warms else server.a if turn else server.b)
            self.period(way(n))
        f = self.forces[first - 1 :]
        steps = [norm(sub(b, a)) for a, b in pairwise(f)]
        climbs = [norm(sub(b, a)) for a, b in zip(f, f[_SPAN:], strict=False)]
        return max(steps), max(climbs, default=0.0)


def rested(device: tuple[float, float], of: float, speed: float, rest: int) -> Attacked:
    """Return a hand that pressed at a speed [m/s] into an object [N/m] and rested so long [ms]."""
    hand = Attacked(*device, object_stiffness=of)
    hand.press(speed)
    hand.rest(rest)
    return hand


def attacked(hand: Attacked, server: Server, periods: int, way: str = "still") -> dict[str, float]:
    """Return the largest changes of the force of a copy of a hand under an attack [N]."""
    copied: Any = copy.copy(hand)
    copied.forces = list(hand.forces[-_SPAN - 1 :])
    step_of, climb = copied.suffer(server, periods, WAYS[way])
    return {"step": step_of, "climb": climb}
