"""Twelve sessions in virtual time, drawn from their seeds, with everything that moves a force.

Each body has its own session. Law, geometry, friction, delay, jitter, the hands, and when users
come, change their law, fall silent and leave are drawn. What comes out depends on nothing else, so
two trees of which one only moved code give the same bits (`golden.py`).
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cohaptic.control.law import Law
from cohaptic.protocol.messages import FixedGains, GeometryName
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.simulated.cast import cast
from cohaptic.simulated.hand import Hand, HandScript, Rhythm
from cohaptic.vec import Vec3
from cohaptic_client.devices.simulated import SimulatedDevice
from cohaptic_experiments.sliding.slide_solid import ServedSolid
from cohaptic_experiments.virtual_session import VirtualSession, VirtualUser
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.bodies.balloon.rubber_balloon import RubberBalloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.modal.modal_body import ModalBody, Modes
from cohaptic_server.bodies.rubber_solid.rubber_solid import RubberSolid
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.bodies.solid.vibration import natural_modes
from cohaptic_server.bodies.spring import Spring
from cohaptic_server.bodies.viscous import Viscous
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.testing.blocks import block
from cohaptic_server.testing.soft_ring import fixed, ring

LENGTH = 3.0  # s; everybody has come by 0.6, and touches within 0.5 more
USERS = 3
STEP = 0.005  # s between two looks at what has arrived; a patch comes every 11 ms at most
_COARSE = BalloonSettings(subdivisions=2, contact_radius=0.03)


def _block() -> Solid:
    mesh = block((0.06, 0.06, 0.12), (3, 3, 6))
    return Solid(mesh, mesh.vertices[:, 2] <= 0.0, SolidSettings(6e3, 0.45, 0.012))


def _swinging() -> ModalBody:
    solid = _block()
    found = natural_modes(solid.shape, 1000.0, 3)
    shapes = found.shapes[:, solid.shape.surface] / found.frequency[:, None, None]
    return ModalBody(solid, Modes(found.frequency, np.ascontiguousarray(shapes), 0.1), 1.0 / 60.0)


def _rubber_block() -> RubberSolid:
    mesh = block((0.06, 0.06, 0.06), (2, 2, 2))
    return RubberSolid(mesh, mesh.vertices[:, 2] <= 0.0, SolidSettings(2e4, 0.45, 0.015))


def _ring() -> Solid:
    mesh = ring(24, 12)
    return Solid(mesh, fixed(mesh), SolidSettings(order=1))


def _served_ring() -> Solid:
    mesh = ring(40, 20)
    body = ServedSolid(mesh, fixed(mesh), SolidSettings(order=1))
    body.in_background()
    return body


# Name, rate of the simulation [Hz], and the body, by seed.
SESSIONS: tuple[tuple[str, float, Callable[[], Body]], ...] = (
    ("balloon", 60.0, lambda: Balloon(_COARSE)),
    ("fine balloon", 60.0, Balloon),
    ("slow balloon", 30.0, lambda: Balloon(_COARSE)),
    ("relaxing balloon", 60.0, lambda: Balloon(_COARSE, damping=2.0)),
    ("rubber balloon", 60.0, lambda: RubberBalloon(_COARSE)),
    ("spring", 60.0, Spring),
    ("block", 60.0, _block),
    ("relaxing block", 60.0, lambda: Viscous(_block(), 1.5)),
    ("swinging block", 60.0, _swinging),
    ("rubber block", 60.0, _rubber_block),
    ("ring", 90.0, _ring),
    ("served ring", 60.0, _served_ring),
)


@dataclass(frozen=True, slots=True)
class Visit:
    """A user of a session, and what happens to it; all times in seconds of the session.

    Args:
        comes: When it joins.
        leaves: When its client dies; infinite if it does not.
        law: At first.
        then: Another law or gains of its own, from `changes` on; None for neither.
        changes: When.
        silent: When it hears nothing and says nothing, from and to.
        script: Script of its hand, before its place on the body is known.
        delay: One way [s].
        jitter: Largest extra delay [s].
        geometry: Geometry of its patches.
        friction: Coefficient.
        damping: Budget of its device [N s/m].
    """

    comes: float
    leaves: float
    law: Law
    then: Law | FixedGains | None
    changes: float
    silent: tuple[float, float]
    script: HandScript
    delay: float
    jitter: float
    geometry: GeometryName
    friction: float
    damping: float


def draw(seed: int) -> list[Visit]:
    """The visits of a session."""
    rng = random.Random(seed)
    turn = rng.uniform(-math.pi, math.pi)
    return [_visit(rng, turn, k) for k in range(USERS)]


def _visit(rng: random.Random, turn: float, number: int) -> Visit:
    # Hands meet the body at a third of it each, with some play.
    angle = turn + 2.0 * math.pi / USERS * (number + rng.uniform(-0.3, 0.3))
    rhythm = rng.choice((None, Rhythm(0.8), Rhythm(0.4)))
    drag = rng.uniform(-0.02, 0.02) if rhythm and rng.random() < 0.5 else 0.0
    hand = Hand(stiffness=rng.choice((200.0, 400.0, 1000.0)))
    angle, depth = math.remainder(angle, 2.0 * math.pi), rng.uniform(0.003, 0.01)
    delay = rng.choice((0.0, 0.02, 0.08, 0.25))
    # A hand that was inside before its first patch came would feel nothing until it let go.
    script = HandScript(angle, depth, rhythm, 0.2 + 2.0 * delay, hand, drag=drag)
    gains = FixedGains(k_h=rng.uniform(50.0, 200.0))
    silence = rng.uniform(1.2, 2.0)
    return Visit(
        comes=0.3 * number * rng.random(),
        leaves=rng.uniform(2.0, 2.6) if number == USERS - 1 else math.inf,
        law=rng.choice((Law.PREDICTIVE, Law.PREDICTIVE, Law.PI, Law.PROPORTIONAL)),
        then=rng.choice((None, None, Law.PREDICTIVE, Law.PI, gains)),
        changes=rng.uniform(1.4, 2.2),
        silent=(silence, silence + rng.uniform(0.1, 0.6)) if rng.random() < 0.3 else (0.0, 0.0),
        script=script,
        delay=delay,
        jitter=rng.choice((0.0, 0.01, 0.05)),
        geometry=rng.choice(("plane", "sphere", "mesh")),
        friction=rng.choice((0.0, 0.0, 0.3, 0.8)),
        damping=rng.choice((0.0, 8.0, 8.0)),
    )


@dataclass(frozen=True, slots=True)
class Trace:
    """What a user got in every haptic period, from its coming to its leaving.

    Args:
        force: On its hand, shape (n, 3) [N].
        felt: Force felt of the others, shape (n,) [N].
        patches: All that arrived, as frames, one behind the other.
    """

    force: Floats
    felt: Floats
    patches: bytes


class _Felt(SimulatedDevice):
    """A simulated device that remembers its forces."""

    forces: list[Vec3]

    def write(self, force: Vec3) -> None:
        self.forces.append(force)
        super().write(force)


class _Player:
    """Plays one session."""

    def __init__(self, seed: int) -> None:
        _, hz, body = SESSIONS[seed]
        self._session = VirtualSession(body(), hz)
        self._visits = draw(seed)
        self._users: dict[int, VirtualUser] = {}
        self._patches: dict[int, list[bytes]] = {k: [] for k in range(USERS)}
        self._changed: set[int] = set()

    def play(self, seconds: float) -> list[Trace]:
        """What the users felt, in the order of their numbers."""
        for k in range(round(seconds / STEP)):
            for number, visit in enumerate(self._visits):
                self._happen(number, visit, k * STEP)
            self._session.run(STEP)
            for number, user in self._users.items():
                self._look(number, user)
        return [
            Trace(_forces_of(user), np.array(user.felt), b"".join(self._patches[number]))
            for number, user in self._users.items()
        ]

    def _happen(self, number: int, visit: Visit, t: float) -> None:
        """Whatever a visit says of the time until `t` [s]."""
        name = str(number)
        if number not in self._users:
            if t >= visit.comes:
                self._users[number] = self._join(name, visit)
        elif name in self._session.users:
            user = self._users[number]
            user.listening = user.talking = not visit.silent[0] <= t < visit.silent[1]
            if t >= visit.leaves:
                self._session.drop(name)
            elif visit.then is not None and t >= visit.changes and number not in self._changed:
                self._changed.add(number)
                law = visit.then if isinstance(visit.then, Law) else Law.PROPORTIONAL
                gains = None if isinstance(visit.then, Law) else visit.then
                self._session.set_law(name, law, gains)

    def _join(self, name: str, visit: Visit) -> VirtualUser:
        room = self._session.room
        about, mesh = describe(room.body), RestMesh.decode(room.frames.touch_mesh())
        reach = room.body.contact_radius
        place = cast(mesh, about.center, about.radius, reach, visit.script.angle)
        script = replace(visit.script, place=place)
        device = _Felt(script.hand, script.intention(about.center, about.radius))
        device.forces = []
        return self._session.join(
            name,
            script,
            law=visit.law,
            delay=visit.delay,
            jitter=visit.jitter,
            seed=int(name),
            max_damping=visit.damping,
            geometry=visit.geometry,
            friction=visit.friction,
            device=device,
        )

    def _look(self, number: int, user: VirtualUser) -> None:
        """Take the newest patch down, if it is another one."""
        patch, seen = user.state.patch, self._patches[number]
        if patch is not None:
            frame = patch.encode()
            if not seen or seen[-1] != frame:
                seen.append(frame)


def _forces_of(user: VirtualUser) -> Floats:
    assert isinstance(user.device, _Felt)
    return np.array(user.device.forces)


def play(seed: int, seconds: float = LENGTH) -> list[Trace]:
    """Play a session.

    Args:
        seed: Which one, from 0 to 11.
        seconds: Its length [s].

    Returns:
        What each user felt.
    """
    return _Player(seed).play(seconds)
