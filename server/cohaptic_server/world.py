"""The world advances by one simulation period: forces in, patches out. No I/O.

Order within a tick: find each contact on the surface free of its own force, let the body respond to
all forces at once, then cut one patch per user. A user who is gone, or whose samples stopped, lets
go over `RELEASE_TIME`: nobody else's force jumps because a cable was pulled.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from cohaptic.control.delay import LoopDelay
from cohaptic.control.friction import Compliance3, tangential
from cohaptic.control.gains import choose_gains, coupled_stiffness
from cohaptic.control.law import Gains, Law
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.vec import Vec3, scale
from cohaptic_server.bodies.body import Body, Response
from cohaptic_server.bodies.mesh import Floats
from cohaptic_server.contact import Contact, locate
from cohaptic_server.loads import (
    Press,
    compliance_between,
    contact_compliance,
    free_of,
    spans,
)
from cohaptic_server.patch_shape import with_shape

RELEASE_TIME = 0.3  # s; a hand that lets go on purpose takes about as long
REACH = 0.03  # m above the surface: further off a probe carries no force
RIGID = 1e-6  # m/N; a contact on what is held has no compliance, and a stiffness has a limit
NEAR = 0.005  # m above the surface: from here on a probe counts fully as a neighbour
_AT_ONCE = 0.001  # s between two samples that say nothing of a velocity
_SMOOTHING = 0.3  # share of a new velocity in the running mean
# Share of the way that the surface on which a contact is found follows the body in a tick. Several
# contacts that each slide to where the last tick's forces took the surface would throw each other
# to and fro, on a body that softens under load; `equilibrium` takes half steps as well.
_FOLLOW = 0.5


@dataclass(frozen=True, slots=True)
class Touch:
    """The newest that is known of one user.

    Args:
        user: Its number.
        law: Local model it runs.
        max_stiffness: Of its device [N/m].
        max_force: Of its device [N].
        probe: Tip [m].
        force: On the hand [N].
        seq: Of the sample; 0 before the first.
        tick: Of the patch that the sample was made with; 0 for none.
        t_client: Stamp of the sample, on the client's clock [s].
        arrived: When the sample came, on the server's clock [s].
        fresh: Whether samples still come; the force of a stale one is let go.
        fixed_gains: That the user chose itself, where the server allows it.
        geometry: Of the patches that it wants.
        friction: Whether its force may have a part along the surface.
    """

    user: int
    law: Law
    max_stiffness: float
    max_force: float
    probe: Vec3
    force: Vec3
    seq: int
    tick: int
    t_client: float
    arrived: float
    fresh: bool = True
    fixed_gains: Gains | None = None
    geometry: Geometry = Geometry.PLANE
    friction: bool = False


@dataclass(frozen=True, slots=True)
class UserState:
    """What the world remembers of a user between ticks.

    Args:
        touch: Its newest sample.
        contact: Where it was.
        presence: Share of its force that the body carries, from 0 to 1.
        force: Normal force that the body carries [N].
        along: Force along the surface that it carries, shape (3,) [N]; None without friction.
        delay: Of its loop, as measured.
        velocity: Of its probe, smoothed, shape (3,) [m/s].
        surface: Displacement of the free surface that its contact is found on, (n, 3) [m].
        free: Displacement without its own force, (n, 3) [m]; None until the tick is over.
    """

    touch: Touch
    contact: Contact
    presence: float
    force: float
    along: Floats | None = None
    delay: LoopDelay = field(default_factory=LoopDelay)
    velocity: Floats = field(default_factory=lambda: np.zeros(3))
    surface: Floats | None = None
    free: Floats | None = None

    @property
    def press(self) -> Press:
        """What the user does to the body."""
        return Press(self.contact, self.force, self.along)


@dataclass(frozen=True, slots=True)
class WorldState:
    """The world between two ticks.

    Args:
        tick: Number of the last tick; 0 before the first.
        users: By number, in the order of the response's loads.
        response: Of the body at that tick.
    """

    tick: int = 0
    users: Mapping[int, UserState] = field(default_factory=lambda: MappingProxyType({}))
    response: Response | None = None


def advance(
    body: Body, state: WorldState, touches: Iterable[Touch], *, now: float, dt: float
) -> tuple[WorldState, dict[int, Patch]]:
    """One simulation tick.

    Args:
        body: The deformable object.
        state: The world after the last tick.
        touches: Of every user who is here.
        now: Time of this tick on the server's clock [s].
        dt: Simulation period N T [s].

    Returns:
        The world after this tick, and a patch for each of `touches`.
    """
    here = {touch.user: touch for touch in touches}
    users = _carry_over(state.users, here, dt)
    placed = [_place(body, state, user, now=now, dt=dt) for user in users]
    presses = [user.press for user in placed]
    where = spans(presses)
    loads = [load for press in presses for load in press.loads()]
    response = body.respond(loads, state.response)
    fields = [free_of(response, p, span) for p, span in zip(presses, where, strict=True)]
    free = [user.contact.moved(field) for user, field in zip(placed, fields, strict=True)]
    nearness = np.array([_nearness(u, point) for u, point in zip(placed, free, strict=True)])
    C = compliance_between(response, where) * nearness
    tick = state.tick + 1
    patches = {
        user.touch.user: with_shape(
            _cut(
                user,
                free[i],
                _row(C, response, where, i),
                i,
                contact_compliance(response, presses[i], where[i]),
                tick=tick,
                now=now,
                dt=dt,
            ),
            user.touch.geometry,
            body,
            fields[i],
            user.velocity,
            # In use until the patch after the next sample is here, and while the loop moves on.
            user.delay.value + 2.0 * dt,
        )
        for i, user in enumerate(placed)
        if user.touch.user in here
    }
    after = MappingProxyType(
        {u.touch.user: replace(u, free=field) for u, field in zip(placed, fields, strict=True)}
    )
    return WorldState(tick, after, response), patches


@dataclass(frozen=True, slots=True)
class _Present:
    touch: Touch
    presence: float


def _carry_over(
    before: Mapping[int, UserState], here: Mapping[int, Touch], dt: float
) -> list[_Present]:
    """Who takes part in this tick: those heard, rising to full presence; the others, falling."""
    step = dt / RELEASE_TIME
    present: list[_Present] = []
    for number, user in before.items():
        touch = here.get(number, replace(user.touch, fresh=False))
        presence = user.presence + (step if touch.fresh else -step)
        if number in here or presence > 0.0:
            present.append(_Present(touch, min(1.0, max(0.0, presence))))
    present += [_Present(touch, min(1.0, step)) for n, touch in here.items() if n not in before]
    return present


def _place(body: Body, state: WorldState, present: _Present, *, now: float, dt: float) -> UserState:
    """Find the contact on the surface of the last tick, and the force that counts there."""
    touch = present.touch
    probe = np.array(touch.probe)
    before = state.users.get(touch.user)
    free = surface = _free_before(body, state, before)
    if before is not None and before.surface is not None:
        surface = before.surface + _FOLLOW * (free - before.surface)
    contact = locate(
        body.mesh,
        probe,
        surface,
        radius=body.contact_radius,
        hint=None if before is None else before.contact,
    )
    height = contact.normal @ (probe - contact.moved(free))
    pressed = float(np.clip(contact.normal @ np.array(touch.force), 0.0, touch.max_force))
    force = present.presence * pressed if height < REACH else 0.0
    along: Floats | None = None
    if touch.friction:
        along = np.array(
            tangential(scale(touch.force, present.presence), _vec(contact.normal), force)
        )
    return UserState(
        touch,
        contact,
        present.presence,
        force,
        along,
        _measure(state, before, touch, now=now, dt=dt),
        _velocity(before, touch),
        surface,
    )


def _velocity(before: UserState | None, touch: Touch) -> Floats:
    """Of the probe after the newest sample, shape (3,) [m/s]: where its patch has to reach."""
    if before is None:
        return np.zeros(3)
    passed = touch.t_client - before.touch.t_client
    if passed < _AT_ONCE:
        return before.velocity if touch.fresh else np.zeros(3)
    new = (np.array(touch.probe) - np.array(before.touch.probe)) / passed
    return np.asarray(before.velocity + _SMOOTHING * (new - before.velocity))


def _measure(
    state: WorldState, before: UserState | None, touch: Touch, *, now: float, dt: float
) -> LoopDelay:
    """The user's loop delay after the sample of this tick, if it is a new one."""
    delay = LoopDelay() if before is None else before.delay
    seen = before is not None and before.touch.seq == touch.seq
    if seen or not 0 < touch.tick <= state.tick:
        return delay
    return delay.measured((state.tick + 1 - touch.tick) * dt, now)


def _free_before(body: Body, state: WorldState, before: UserState | None) -> Floats:
    """Displacement of the last tick without the user's own force, shape (n, 3) [m]."""
    if before is not None and before.free is not None:
        return before.free
    if state.response is None:
        return np.zeros_like(body.mesh.vertices)
    return state.response.displacement


def _nearness(user: UserState, point: Floats) -> float:
    """How much a user counts as a neighbour: 1 in contact or about to be, 0 out of reach."""
    height = float(user.contact.normal @ (np.array(user.touch.probe) - point))
    fade = (REACH - height) / (REACH - NEAR)
    return 1.0 if user.force > 0.0 else min(1.0, max(0.0, fade))


def _row(C: Floats, response: Response, where: list[slice], i: int) -> list[float]:
    """Row i of C as the gains of user i see it: itself in full, the others by their nearness."""
    row: list[float] = C[i].tolist()
    row[i] = max(float(response.compliance[where[i].start, where[i].start]), RIGID)
    return row


def _cut(
    user: UserState,
    x_free: Floats,
    row: list[float],
    i: int,
    compliance: Compliance3 | None,
    *,
    tick: int,
    now: float,
    dt: float,
) -> Patch:
    """The patch of one user."""
    touch, contact = user.touch, user.contact
    c_ii = row[i]
    gains = choose_gains(
        touch.law,
        row,
        i,
        max_stiffness=touch.max_stiffness,
        loop_delay=user.delay.value,
        simulation_period=dt,
        fixed=touch.fixed_gains,
    )
    return Patch(
        tick=tick,
        seq=touch.seq,
        t_server=now,
        t_client=touch.t_client,
        sample_wait=max(0.0, now - touch.arrived),
        geometry=Geometry.PLANE,  # until `with_shape`
        law=touch.law,
        x_free=_vec(x_free),
        normal=_vec(contact.normal),
        curvature=0.0,
        k_o=1.0 / c_ii,
        k_o_coupled=coupled_stiffness(row),
        c_ii=c_ii,
        k_h=gains.k_h,
        integral_gain=gains.integral_gain,
        own_force=user.force,
        u_others=float(contact.normal @ (x_free - contact.point)),
        compliance=compliance,
    )


def _vec(a: Floats) -> Vec3:
    return (float(a[0]), float(a[1]), float(a[2]))
