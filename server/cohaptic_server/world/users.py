"""The users of a room as arrays, which a tick passes from stage to stage, and the world's state.

In a tick of many users Python calls cost more than arithmetic, so each stage is one call for all
users (docs/design/wire.md). Row i of every array belongs to the same user. The `UserState` of one
user is made only when a caller reads it.

A world that all users have left comes to rest: it becomes the initial world again, except its tick
number. At rest a tick changes only the number, so ticks without any client need not be computed: a
room that sleeps through these ticks ends in the same state as a room that computes them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from cohaptic.control.delay import LoopDelay
from cohaptic.control.friction import Compliance3
from cohaptic.control.hand_model import HandModel
from cohaptic.control.room_lag import RoomLag
from cohaptic_server.bodies.body import Response
from cohaptic_server.numeric import Floats, Ints, Mask, vec3
from cohaptic_server.world.contact import NO_CONTACTS, Contacts
from cohaptic_server.world.displacement_field import (
    NOWHERE_KNOWN,
    CachedField,
    Field,
    FlatterField,
    FreeField,
    KnownFields,
    ZeroField,
)
from cohaptic_server.world.lags.planning import CALM_TIME
from cohaptic_server.world.partners.learning import Learned
from cohaptic_server.world.patch_geometry import Windows
from cohaptic_server.world.state import (
    NO_CAUSE,
    NOTHING,
    Anticipation,
    Carried,
    LagCause,
    Release,
    Touch,
    UserState,
)


def vectors(rows: Sequence[Sequence[float]]) -> Floats:
    """Return one vector per row as an array, also for no rows, shape (n, 3)."""
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class Observed:
    """Free surfaces of n users at the end of a tick.

    Args:
        response: Response of the body to all loads.
        spans: First load of each user, and the end of the last user's loads, shape (n + 1,).
        forces: Forces of these loads, shape (l,) [N].
        windows: Vertices round the contacts, at which the surfaces are stored.
        free: Displacement of the free surfaces at these vertices, shape (k, 3) [m].
        shown: Displacement of each contact [m], and the factor of the differences from it beyond
            the window, by which a bulge is flattened, shape (n, 4); None if no surface is
            flattened.
        x_free: Contact points on the free surfaces, shape (n, 3) [m].
    """

    response: Response
    spans: Ints
    forces: Floats
    windows: Windows
    free: Floats
    shown: Floats | None
    x_free: Floats

    def field(self, i: int) -> CachedField:
        """Return the displacement of one user's free surface, for all vertices."""
        a, b = self.windows.starts[0, i : i + 2].tolist()
        return CachedField(self.windows.vertices[a:b], self.free[a:b], self.elsewhere(i))

    def elsewhere(self, i: int) -> Field:
        """Return the displacement of one user's free surface beyond its window."""
        first, last = self.spans[i : i + 2].tolist()
        free = FreeField(self.response, self.forces[first:last], slice(first, last))
        if self.shown is None or (fraction := float(self.shown[i, 3])) == 1.0:
            return free
        return FlatterField(free, self.shown[i, :3], fraction)


class Hand(NamedTuple):
    """Properties of a user on which the room's lag depends.

    Args:
        touch: Newest sample of the user, with its settings.
        delay: Measured delay of the user's loop.
    """

    touch: Touch
    delay: LoopDelay


@dataclass(frozen=True, eq=False, slots=True)
class Tracked:
    """The n users of a tick, with their contacts and the forces that they request there.

    Args:
        touches: Newest samples of the users.
        before: Row of each user in the tick before; -1 for a user who was not there, shape (n,).
        probes: Positions of the tips, shape (n, 3) [m].
        settings: One column per user, shape (4, n): largest force [N] and largest stiffness [N/m]
            of the device, time stamp of the sample [s], and 1 if samples still arrive, else 0.
        presence: Share of each user's force that counts, 0 to 1, shape (n,).
        requested: Normal forces that users request, before lag and limits, shape (n,) [N].
        tangential: Tangential forces that users request, before lag and limits; zeros without
            friction, shape (n, 3) [N].
        frictional: Rows of the users who may have a tangential force.
        delays: Measured delays of the users' loops.
        velocity: Velocity of the probes, smoothed, shape (n, 3) [m/s].
        asked: Normal forces in the users' samples, of those within the devices' limits, shape (n,)
            [N].
        surfaces: Surfaces on which the contacts are tracked, which follow the free surfaces with a
            delay (`contact_tracking.RELAXATION`); one for each row of the tick before.
    """

    touches: Sequence[Touch]
    before: Ints
    probes: Floats
    settings: Floats
    contacts: Contacts
    presence: Floats
    requested: Floats
    tangential: Floats
    frictional: Sequence[int]
    delays: Sequence[LoopDelay]
    velocity: Floats
    asked: Floats
    surfaces: KnownFields


def settings_of(touches: Sequence[Touch]) -> Floats:
    """Return `Tracked.settings` for some samples, shape (4, n)."""
    rows = [(t.who.max_force, t.who.max_stiffness, t.t_client, t.fresh) for t in touches]
    return np.ascontiguousarray(np.array(rows, dtype=np.float64).reshape(-1, 4).T)


NOBODYS: Mask = np.zeros(0, dtype=np.bool_)


class Applied(NamedTuple):
    """The forces of the users that the body carries in a tick.

    Args:
        presence: Share of each user's force that counts, 0 to 1, shape (n,).
        force: Normal force of each user, shape (n,) [N].
        tangential: Tangential force of each user, zeros without friction, shape (n, 3) [N].
        deep: Whether each force was cut to the limit of its contact or of the body, shape (n,).
        fast: Whether the change of each force was cut because it would shake others, shape (n,).
    """

    presence: Floats
    force: Floats
    tangential: Floats
    deep: Mask = NOBODYS
    fast: Mask = NOBODYS


@dataclass(frozen=True, eq=False)
class Users(Mapping[int, UserState]):
    """The users of a room after a tick, as a mapping from user numbers to `UserState` values.

    Args:
        observed: Free surfaces of the users; None before the first tick is over.
        compliance: 3x3 compliance of each contact, None without friction; empty before the end of
            the tick.
        k_o_coupled: Coupling-aware stiffness of each user; empty before the end of the tick [N/m].
    """

    tracked: Tracked
    applied: Applied
    observed: Observed | None = None
    compliance: Sequence[Compliance3 | None] = ()
    k_o_coupled: Sequence[float] = ()

    @cached_property
    def rows(self) -> dict[int, int]:
        """Row of each user by its number."""
        return {touch.user: i for i, touch in enumerate(self.tracked.touches)}

    @cached_property
    def _states(self) -> dict[int, UserState]:
        return {}

    def __getitem__(self, number: int, /) -> UserState:
        state = self._states.get(number)
        if state is None:
            self._states[number] = state = self._state(self.rows[number])
        return state

    def __iter__(self) -> Iterator[int]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.tracked.touches)

    def _state(self, i: int) -> UserState:
        tracked, applied, observed = self.tracked, self.applied, self.observed
        frictional = tracked.touches[i].who.friction
        return UserState(
            touch=tracked.touches[i],
            contact=tracked.contacts.contact(i),
            presence=float(applied.presence[i]),
            force=float(applied.force[i]),
            tangential=applied.tangential[i] if frictional else None,
            requested=float(tracked.requested[i]),
            requested_tangential=tracked.tangential[i] if frictional else None,
            delay=tracked.delays[i],
            velocity=vec3(tracked.velocity[i]),
            free=None if observed is None else observed.field(i),
            compliance=self.compliance[i] if self.compliance else None,
            k_o_coupled=self.k_o_coupled[i] if self.k_o_coupled else 0.0,
        )


NOBODY = Users(
    Tracked(
        (),
        np.zeros(0, dtype=np.int64),
        vectors(()),
        settings_of(()),
        NO_CONTACTS,
        np.zeros(0),
        np.zeros(0),
        vectors(()),
        (),
        (),
        vectors(()),
        np.zeros(0),
        NOWHERE_KNOWN,
    ),
    Applied(np.zeros(0), np.zeros(0), vectors(())),
)


class Forbidden(NamedTuple):
    """The reason why clients last had to do without models of the hands.

    Args:
        by: `hand` for one that presses and cannot be modelled; `link` for one that presses and
            whose delay jumps; `number` if more hands press than a patch carries; `object` if the
            object or a contact on it is no linear spring.
        users: Numbers of the users of such hands or links; empty for another reason.
    """

    by: Literal["hand", "link", "number", "object"] = "hand"
    users: tuple[int, ...] = ()


NOTHING_FORBIDDEN = Forbidden()


@dataclass(frozen=True, eq=False, slots=True)
class Wishes:
    """What is kept of the hands that clients move models of, from tick to tick.

    Args:
        intended: Depth that each hand would have below the surface without any force, behind its
            lag, by user [m].
        hands: What is known of each hand, by user.
        past: Number and models of each of the last ticks, oldest first.
        weight: Share of the models' forces in what clients show, 0 to 1.
        forbidden_at: Last time at which models were forbidden [s].
        forbidden: Reason for which they were then.
        learned_at: Last time at which a window of any hand was taken in [s].
    """

    intended: Mapping[int, float] = field(default_factory=dict[int, float])
    hands: Mapping[int, Learned] = field(default_factory=dict[int, Learned])
    past: tuple[tuple[int, Mapping[int, HandModel]], ...] = ()
    weight: float = 1.0
    forbidden_at: float = -math.inf
    forbidden: Forbidden = NOTHING_FORBIDDEN
    learned_at: float = -math.inf


@dataclass(frozen=True, slots=True)
class WorldState:
    """The world between two ticks.

    Args:
        tick: Number of the last tick; 0 before the first.
        users: Users by number, in the order of the response's loads.
        response: Response of the body at that tick; None before the first.
        releases: Forces that fade at contacts from which their probes have jumped away.
        room: Lag of the room, with the coupling and the margin from which it was chosen.
        coupling: Compliance C between the users, in the order of `users`, shape (n, n) [m/N].
        turning: Time constant of the lag with which other users turn a steep contact [s].
        anticipation: Part of the coupling that the next tick anticipates.
        past: Forces that the body carried in ticks that samples may still answer, oldest first.
        unknown_at: Last time at which a tick could not determine the coupling [s].
        cause: Reason for the length of the room's lag.
        wishes: Wishes of the hands that clients move models of.
    """

    tick: int = 0
    users: Users = field(default_factory=lambda: NOBODY)
    response: Response | None = None
    releases: tuple[Release, ...] = ()
    room: RoomLag = field(default_factory=RoomLag)
    coupling: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    turning: float = 0.0
    anticipation: Anticipation = NOTHING
    past: tuple[Carried, ...] = ()
    unknown_at: float = -math.inf
    cause: LagCause = NO_CAUSE
    wishes: Wishes = field(default_factory=Wishes)

    def free_field(self, row: int) -> Field:
        """Return the displacement of the free surface of the user in `row`.

        Row -1 stands for a user who was not in the last tick: the surface under all forces.
        """
        observed = self.users.observed
        if observed is not None and row >= 0:
            return observed.field(row)
        if self.response is None:
            return ZeroField()
        return FreeField(self.response, np.zeros(0), slice(0, 0))


# J; a dent or a swing of less energy would push a fingertip by less than `state.NEGLIGIBLE`: a
# surface of compliance C with the energy U pushes by sqrt(2 U / C) at most, and C is at least
# 2e-6 m/N at every contact.
REST_ENERGY = 1e-12


def is_at_rest(state: WorldState) -> bool:
    """Return whether the world has no response, user or fading force, as before the first touch."""
    return state.response is None and not len(state.users) and not state.releases


def pass_over(state: WorldState, ticks: int) -> WorldState:
    """Return a world at rest after `ticks` further ticks without users."""
    return replace(state, tick=state.tick + ticks)


def settled(state: WorldState, now: float) -> WorldState:
    """Return the initial world if the body's remaining motion is too weak to feel, else `state`.

    Args:
        state: State of the world after a tick.
        now: Time of the tick [s].
    """
    response = state.response
    if response is None or len(state.users) or state.releases:
        return state
    if state.room.lag > 0.0 or now - state.unknown_at < CALM_TIME:
        return state
    return WorldState(state.tick) if abs(response.energy) <= REST_ENERGY else state
