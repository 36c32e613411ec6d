"""Values of one user: its newest sample, its state after a tick, and the force of it that fades.

Between two ticks the world also keeps the forces that the body carried in earlier ticks, and the
part of the coupling that the next tick anticipates (science 3.13).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from cohaptic.control.delay import LoopDelay
from cohaptic.control.friction import Compliance3
from cohaptic.control.hand_model import HandModel
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Gains
from cohaptic.protocol.patch import Geometry
from cohaptic.vec import ZERO, Vec3, add, scale
from cohaptic_server.numeric import Floats, Ints, vec3
from cohaptic_server.world.contact import Contact
from cohaptic_server.world.displacement_field import CachedField
from cohaptic_server.world.loads import Press

# N; a smaller force counts as none. Behind the room's lag a released force decays exponentially and
# never quite reaches zero. A fiftieth of what a fingertip notices (`safety.EXTERNAL_RATE`).
NEGLIGIBLE = 1e-3


@dataclass(frozen=True, slots=True)
class TickTime:
    """Number and time of one tick.

    Args:
        number: Number of the tick; 1 for the first.
        now: Time of the tick on the server's clock [s].
        period: Simulation period N T, the time from tick to tick if none is late [s].
        elapsed: Time since the last tick, at most four periods [s].
    """

    number: int
    now: float
    period: float
    elapsed: float


@dataclass(frozen=True, slots=True)
class Participant:
    """A user as the world knows it: what its client and its device are.

    Args:
        user: Number of the user, which is never used twice.
        law: Control law that the client runs on its local model.
        max_stiffness: Largest stiffness of the device [N/m].
        max_force: Largest force on the body that device, token and room allow [N].
        fixed_gains: Gains that the user chose, if the server allows it.
        geometry: Geometry of the patches that the client requests.
        friction: Whether the force may have a tangential part.
        damping_budget: Damping that the client's passivity layer may add [N s/m].
    """

    user: int
    law: Law
    max_stiffness: float
    max_force: float
    fixed_gains: Gains | None = None
    geometry: Geometry = Geometry.PLANE
    friction: bool = False
    damping_budget: float = 0.0


@dataclass(frozen=True, slots=True)
class Touch:
    """A sample of a participant: what its hand does.

    Args:
        who: The participant.
        probe: Position of the tip [m].
        force: Force on the hand [N].
        seq: Number of the sample; 0 before the first.
        tick: Tick of the patch that the sample answers; 0 if it answers none.
        t_client: Time stamp of the sample on the client's clock [s].
        arrived: Arrival of the sample on the server's clock [s].
        fresh: Whether samples still arrive; a stale user's force is released.
        anchor: Point of the resting surface that the finger holds by friction [m]; None if it
            holds no point.
        deflection: Displacement of the hand's model, or of the simulated hand, by forces [m]; None
            if the client tells none.
        own_model: The hand itself, of a client that simulates it and moves no models of others.
    """

    who: Participant
    probe: Vec3
    force: Vec3
    seq: int
    tick: int
    t_client: float
    arrived: float
    fresh: bool = True
    anchor: Vec3 | None = None
    deflection: float | None = None
    own_model: HandModel | None = None

    @property
    def user(self) -> int:
        """Number of the user."""
        return self.who.user

    @property
    def moves_models(self) -> bool:
        """Whether the client moves models of the other hands."""
        return self.deflection is not None and self.own_model is None


@dataclass(frozen=True, slots=True)
class UserState:
    """One user after a tick.

    Args:
        touch: Newest sample of the user.
        presence: Share of the user's force that counts, 0 to 1.
        force: Normal force that the body carries, after the room's lag [N].
        tangential: Tangential force that the body carries, shape (3,) [N]; None without friction.
        requested: Normal force of the user before lag and limits [N].
        requested_tangential: Tangential force before lag and limits, shape (3,) [N]; None without
            friction.
        delay: Measured delay of the user's loop.
        velocity: Velocity of the probe, smoothed [m/s].
        free: Displacement of the user's free surface; None until the tick is over.
        compliance: 3x3 compliance of the contact; None without friction or until the tick is over.
        k_o_coupled: Coupling-aware stiffness, 1 / sum_j |C_ij| with the compliance matrix C
            (science 3.2) [N/m].
    """

    touch: Touch
    contact: Contact
    presence: float
    force: float
    tangential: Floats | None = None
    requested: float = 0.0
    requested_tangential: Floats | None = None
    delay: LoopDelay = field(default_factory=LoopDelay)
    velocity: Vec3 = ZERO
    free: CachedField | None = None
    compliance: Compliance3 | None = None
    k_o_coupled: float = 0.0

    @property
    def applied(self) -> Vec3:
        """Force on the hand, the opposite of the force that the body carries [N]."""
        normal = scale(self.contact.places[2], self.force)
        return normal if self.tangential is None else add(normal, vec3(self.tangential))

    @property
    def press(self) -> Press:
        """Contact and force of the user on the body."""
        return Press(self.contact, self.force, self.tangential)


@dataclass(frozen=True, slots=True)
class Release:
    """A force that fades at the contact from which its probe has jumped away.

    Args:
        user: Number of the user whose force it was.
        press: Contact and force when the probe jumped.
        fraction: Share of that force that the body still carries, 1 to 0.
    """

    user: int
    press: Press
    fraction: float

    def faded(self) -> Press:
        """Return the press with the force that the body still carries."""
        tangential = self.press.tangential
        return Press(
            self.press.contact,
            self.fraction * self.press.force,
            None if tangential is None else self.fraction * tangential,
        )


class LagCause(NamedTuple):
    """The reason why a room's lag is as long as it is, and the users who are the reason.

    Args:
        by: `damping` if the lag is for moving hands, which need it the longer the less their
            devices may damp (science 3.8, 3.13); `delay` if it is for loops with a delay (3.8).
        users: Numbers of the users on the devices that may damp least, or with the longest delay;
            empty without a lag, and if no device of the room may damp less than any needs to.
    """

    by: Literal["damping", "delay"] = "damping"
    users: tuple[int, ...] = ()


NO_CAUSE = LagCause()


@dataclass(frozen=True, eq=False, slots=True)
class Carried:
    """Forces of the users that the body carried in one tick.

    Args:
        tick: Number of the tick.
        at: Time of the tick without pauses of the server, from any time on [ns]; whole numbers, so
            that differences are the same however long a room has run.
        users: Numbers of the users, shape (n,).
        forces: Forces on the hands, normal and tangential together, shape (n, 3) [N].
    """

    tick: int
    at: int
    users: Ints
    forces: Floats

    def of(self, users: Ints) -> Floats:
        """Return the forces on some users, zero for a user who was not there, shape (k, 3) [N]."""
        if np.array_equal(users, self.users):
            return self.forces
        rows = {user: i for i, user in enumerate(self.users.tolist())}
        found = np.array([rows.get(user, -1) for user in users.tolist()], dtype=np.int64)
        return np.concatenate([self.forces, np.zeros((1, 3))])[found]


@dataclass(frozen=True, eq=False, slots=True)
class Anticipation:
    """Part of a room's coupling that the next tick anticipates.

    Args:
        users: Numbers of the users who take part, shape (k,).
        owner: Owner of each load as a position in `users`, shape (l,).
        axes: Unit vector of the force on the hand for each load, shape (l, 3).
        part: The matrix X of science 3.13: change of the force of each load (row) per change of the
            force of another load (column), shape (l, l) [N/N].
        solve: The matrix (1 + X)^-1, shape (l, l).
    """

    users: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    owner: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    axes: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    part: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    solve: Floats = field(default_factory=lambda: np.zeros((0, 0)))


NOTHING = Anticipation()
