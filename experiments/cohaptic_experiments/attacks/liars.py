"""Co-users who lie about themselves, in whole sessions with victims who rest.

A liar tells one of two states in turn: by a clock, by chance, or by the motion of a victim. It may
be a client, which tells a deflection of its hand, or a page, which tells the hand, too; it obeys
no pace, and may come again, change its law, and say any tick and any time.
"""

from __future__ import annotations

import copy
import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from cohaptic.control.hand_model import HandModel
from cohaptic.control.law import Law
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.frame import MAX_FORCE, MAX_POSITION
from cohaptic.protocol.partners import HEAVIEST, LIGHTEST
from cohaptic.simulated.hand import HandScript, Intention
from cohaptic.vec import Vec3, add, dot, norm, scale, sub
from cohaptic_client.loop.safety import SafetyLimits
from cohaptic_experiments.attacks.victims import PERIOD, VICTIMS, Harm, Moved, OnRails, harm, seated
from cohaptic_experiments.virtual_session import VirtualSession, VirtualUser
from cohaptic_server.bodies.body import Body
from cohaptic_server.room.body_frames import describe

_ANGLES: Final = (0.0, 2.6)  # rad, of the victims round the object
_DEPTH: Final = 0.008  # m, at which victims rest
_DELAY: Final = 0.01  # s, each way, of the victims
_SETTLED: Final = 3.2  # s until victims rest and models are in use
_CHUNK: Final = 0.005  # s in which a liar may leave, come and change its law


@dataclass(frozen=True)
class Reported:
    """What a liar tells of its hand.

    Args:
        depth: Depth of its tip [m].
        force: Force out of the object [N].
        aside: Force along the surface [N].
        deflection: Displacement of its model [m].
        model: Its hand, if it tells one.
        anchored: Whether it tells an anchor.
    """

    depth: float
    force: float
    aside: float
    deflection: float
    model: HandModel
    anchored: bool


@dataclass(frozen=True)
class Liar:
    """How a co-user lies.

    Args:
        face: Part that it plays: "client", "page", or "both" in turn.
        beside: Angle to the first victim [rad].
        max_force, max_stiffness, damping, friction: Abilities that it tells.
        a, b: What it tells in turn.
        turn: What it takes its turns from.
        half: Periods until the next turn, by the clock.
        each: Periods from sample to sample.
        ticks: What it says of the patches that it has.
        times: What it says of its clock.
        rejoins: Periods after which it comes again; 0 for never.
        laws: Periods after which it changes its law; 0 for never.
    """

    face: str
    beside: float
    max_force: float
    max_stiffness: float
    damping: float
    friction: bool
    a: Reported
    b: Reported
    turn: str
    half: int
    each: int
    ticks: str
    times: str
    rejoins: int
    laws: int


def _report(r: random.Random) -> Reported:
    def between(low: float, high: float) -> float:
        return math.exp(r.uniform(math.log(low), math.log(high)))

    model = r.choice(
        [
            LIGHTEST,
            HEAVIEST,
            HandModel(between(0.03, 0.8), between(0.5, 100.0), between(50.0, 1e4)),
            HandModel(0.03, 0.5, 1e4),
            HandModel(0.8, 0.5, 50.0),
            HandModel(0.8, 0.5, 1e4),
        ]
    )
    return Reported(
        depth=r.choice([-5.0, -0.02, -0.001, 0.0, 0.005, 0.008, 0.02, 0.05, 0.2, 5.0]),
        force=r.choice([0.0, 0.05, 2.0, 10.0, 10.0, 100.0]),
        aside=r.choice([0.0, 0.0, 0.0, 5.0]),
        deflection=r.choice([0.0, 0.0, 0.02, -0.02, 0.2, -0.2, 10.0, -10.0]),
        model=model,
        anchored=r.random() < 0.25,
    )


def draw(r: random.Random) -> Liar:
    """Draw a liar."""
    return Liar(
        face=r.choice(["client", "client", "page", "page", "both"]),
        beside=r.choice([0.12, 0.12, 0.3, 0.8, 2.0]),
        max_force=r.choice([10.0, 10.0, MAX_FORCE]),
        max_stiffness=r.choice([100.0, 2000.0, 1e6]),
        damping=r.choice([0.0, 8.0]),
        friction=r.random() < 0.1,
        a=_report(r),
        b=_report(r),
        turn=r.choice(["clock", "clock", "velocity", "against", "chance"]),
        half=r.choice([1, 16, 17, 33, 50, 62, 100, 250, r.randrange(5, 500)]),
        each=r.choice([1, 5, 16, 16, 16, 40, 200]),
        ticks=r.choice(["true", "true", "true", "none", "future", "one", "jump"]),
        times=r.choice(["true", "true", "true", "one", "jump", "huge", "slow", "fast"]),
        rejoins=r.choice([0, 0, 0, 0, 0, 500, 1000]),
        laws=r.choice([0, 0, 0, 0, 0, 0, 0, 100, 333]),
    )


def alter(liar: Liar, r: random.Random) -> Liar:
    """Change one thing about a liar; what it tells is changed more often."""
    other, name = draw(r), r.choice([*vars(liar), "a", "b", "a", "b"])
    if name not in ("a", "b"):
        return replace(liar, **{name: getattr(other, name)})
    part = r.choice(list(vars(liar.a)))
    reported = replace(getattr(liar, name), **{part: getattr(getattr(other, name), part)})
    return replace(liar, **{name: reported})


class Stage:
    """A session in which victims rest, from which every attack begins.

    Args:
        body: The object.
        kinds: Names of `VICTIMS`, two at most.
        models: Whether the victims' clients move models.
        max_stiffness: Stiffness that their devices render [N/m].
    """

    def __init__(
        self,
        body: Body,
        kinds: tuple[str, ...],
        *,
        models: bool = True,
        max_stiffness: float = 2000.0,
    ) -> None:
        self.session = VirtualSession(body)
        self.kinds, info = kinds, describe(body)
        self.devices: list[OnRails | Moved] = []
        self.paths: list[Intention] = []
        for angle, kind in zip(_ANGLES, kinds, strict=False):
            script = HandScript(angle, depth=_DEPTH, approach_at=0.3)
            path = script.intention(info.center, info.radius)
            device = seated(VICTIMS[kind], path, max_stiffness)
            self.session.join(
                kind, script, device=device, models=models, max_damping=0.0, delay=_DELAY
            )
            self.devices.append(device)
            self.paths.append(path)
        self.session.run(_SETTLED)

    def copied(self) -> Stage:
        """Return a copy with the same object, for one attack."""
        room = self.session.room
        kept: list[Any] = [room.body, room.touched_body, room.frames]
        return copy.deepcopy(self, {id(one): one for one in kept})


@dataclass
class _Lying(VirtualUser):
    """A client that tells what its liar makes up.

    Args:
        liar: How it lies.
        page: Whether it tells its hand.
        path: Way to its place on the object.
        victims: The hands that it attacks.
        r: Source of chance.
        count: Number of periods so far.
    """

    liar: Liar | None = None
    page: bool = False
    path: Intention | None = None
    victims: Sequence[VirtualUser] = ()
    r: random.Random = field(default_factory=lambda: random.Random(0))
    count: int = 0

    def period(self, now: float) -> None:
        """One period: a sample, if one is due."""
        liar, path = self.liar, self.path
        assert liar is not None
        assert path is not None
        self.down.pop_due(now)
        self.count += 1
        if self.count % liar.each:
            return
        reported = liar.a if self._turn(liar, path) else liar.b
        self.seq += 1
        tip = _within(add(path.surface, scale(path.direction, reported.depth)), MAX_POSITION)
        force = add(scale(path.direction, -reported.force), (0.0, 0.0, reported.aside))
        sample = ContactSample(
            self.seq,
            self._tick(liar),
            self._time(liar, now),
            tip,
            _within(force, MAX_FORCE),
            tip if reported.anchored else None,
            reported.deflection,
            reported.model if self.page else None,
        )
        self.up.push(sample.encode(), now)

    def _turn(self, liar: Liar, path: Intention) -> bool:
        if liar.turn == "clock":
            return self.count // liar.half % 2 == 0
        if liar.turn == "chance":
            return self.r.random() < 0.5
        device = self.victims[0].device
        assert isinstance(device, (OnRails, Moved))
        tips = device.track.tips
        deeper = dot(sub(tips[-1], tips[-2]), path.direction) > 0.0
        return deeper == (liar.turn == "velocity")

    def _tick(self, liar: Liar) -> int:
        newest = max(victim.ticks[-1] for victim in self.victims)
        said = {"true": newest, "none": 0, "future": 2**32 - 1, "one": 1}
        if liar.ticks in said:
            return said[liar.ticks]
        return self.r.choice([0, newest, newest + 1000, 2**31])

    def _time(self, liar: Liar, now: float) -> float:
        said = {"true": now, "one": 5.0, "huge": 1e308, "slow": 0.5 * now, "fast": 7.0 * now}
        return said.get(liar.times, now + self.r.choice([-1e6, 1e6, 0.0]))


def _within(v: Vec3, limit: float) -> Vec3:
    size = norm(v)
    return scale(v, 0.999 * limit / size) if size > 0.999 * limit else v


def _join(session: VirtualSession, liar: Liar, victims: list[VirtualUser], turn: int) -> str:
    page, name = liar.face == "page" or (liar.face == "both" and turn % 2 == 1), f"liar{turn}"
    info = describe(session.room.body)
    script = HandScript(_ANGLES[0] + liar.beside, depth=_DEPTH)
    user = session.join(
        name,
        script,
        models=not page,
        tells_hand=page,
        max_stiffness=liar.max_stiffness,
        max_damping=liar.damping,
        limits=SafetyLimits(max_force=liar.max_force),
        friction=0.3 if liar.friction else 0.0,
    )
    path = script.intention(info.center, info.radius)
    lying = _Lying(
        **vars(user), liar=liar, page=page, path=path, victims=victims, r=random.Random(turn)
    )
    session.users[name] = lying
    return name


def attacked(stage: Stage, liar: Liar, seconds: float = 2.5) -> dict[str, Harm]:
    """Play an attack from a stage on; return what it did to each kind of victim."""
    stage = stage.copied()
    session, turn = stage.session, 0
    victims, since = list(session.users.values()), len(stage.devices[0].track.forces)
    name = _join(session, liar, victims, turn)
    laws, r = list(Law), random.Random(0)
    chunk = round(_CHUNK / PERIOD)
    for k in range(chunk, round(seconds / PERIOD) + 1, chunk):
        session.run(_CHUNK)
        if liar.rejoins and k % liar.rejoins < chunk:
            turn += 1
            session.drop(name)
            name = _join(session, liar, victims, turn)
        if liar.laws and k % liar.laws < chunk:
            session.set_law(name, r.choice(laws))
    found: dict[str, Harm] = {}
    for kind, device, path in zip(stage.kinds, stage.devices, stage.paths, strict=True):
        hand = VICTIMS[kind].hand
        found[kind] = harm(device.track, hand.mass if hand else 0.0, path.direction, since)
    return found
