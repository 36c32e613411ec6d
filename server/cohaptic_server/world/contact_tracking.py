"""Where a user touches in this tick, and with what force."""

from __future__ import annotations

import numpy as np

from cohaptic.control.delay import UNKNOWN, LoopDelay
from cohaptic.control.friction import stretch_of, tangential
from cohaptic.vec import scale
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats, vec3
from cohaptic_server.world.contact import REACH, locate
from cohaptic_server.world.displacement_field import Field, FreeOf, Still, Window
from cohaptic_server.world.state import Touch, UserState, WorldState

_AT_ONCE = 0.001  # s between two samples that say nothing of a velocity
_SMOOTHING = 0.3  # share of a new velocity in the running mean
# Share of the way that the surface on which a contact is found follows the body in a tick. Several
# contacts that each slide to where the last tick's forces took the surface would throw each other
# to and fro, on a body that softens under load; `equilibrium` takes half steps as well.
FOLLOW = 0.5


def place(
    body: Body, state: WorldState, touch: Touch, presence: float, *, now: float, dt: float
) -> UserState:
    """Find the contact on the surface of the last tick, and the force that is wanted there.

    Args:
        body: That is touched.
        state: The world after the last tick.
        touch: Newest of this user.
        presence: Share of its force that counts, from 0 to 1.
        now: Time of this tick on the server's clock [s].
        dt: Simulation period N T [s].
    """
    probe = np.array(touch.probe)
    before = state.users.get(touch.user)
    free = _free_before(state, before)
    surface: Field = free
    followed: Window | None = None
    if before is not None and before.surface is not None and before.free is not None:
        surface = followed = _follow(before.surface, before.free)
    elif before is not None:
        followed = before.free
    contact = locate(
        body.mesh,
        probe - _over_material(touch, before),
        surface,
        radius=body.contact_radius,
        hint=None if before is None else before.contact,
    )
    height = contact.normal @ (probe - contact.moved(free))
    pressed = float(np.clip(contact.normal @ np.array(touch.force), 0.0, touch.max_force))
    wanted = presence * pressed if height < REACH else 0.0
    along: Floats | None = None
    if touch.friction:
        along = np.array(tangential(scale(touch.force, presence), vec3(contact.normal), wanted))
    return UserState(
        touch,
        contact,
        presence,
        0.0,  # until `letting_in.let_in`
        None,
        wanted,
        along,
        _measure(state, before, touch, now=now, dt=dt),
        _velocity(before, touch),
        followed,
    )


def _over_material(touch: Touch, before: UserState | None) -> Floats:
    """How far the tip is from the material that it touches, on the free surface, shape (3,) [m].

    A force along the surface takes the material with it, which the free surface does not show: a
    finger that sticks stays on its material, however far the two have gone together (science 3.10).
    """
    if not touch.friction or before is None or before.compliance is None:
        return np.zeros(3)
    return np.array(stretch_of(touch.force, vec3(before.contact.normal), before.compliance))


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
    """The user's loop delay in this tick: the age of the patch that its force answers.

    A force that is held because no newer one comes grows older tick by tick, and its delay with it.
    """
    delay = LoopDelay() if before is None else before.delay
    if not touch.fresh or touch.tick > state.tick:
        return delay
    if touch.tick > 0:
        return delay.measured((state.tick + 1 - touch.tick) * dt, now)
    # Before its first patch a client can name none. One that presses on and still does not is told
    # nothing by ours: its loop may have any delay.
    late = before is not None and before.presence >= 1.0
    return delay.measured(UNKNOWN, now) if late else delay


def _follow(surface: Window, free: Window) -> Window:
    """The surface that a contact is found on, a part of the way after the body."""
    was = surface[free.vertices]
    return Window(free.vertices, was + FOLLOW * (free.values - was), free.beyond)


def _free_before(state: WorldState, before: UserState | None) -> Field:
    """Displacement of the last tick without the user's own force."""
    if before is not None and before.free is not None:
        return before.free
    if state.response is None:
        return Still()
    return FreeOf(state.response, np.zeros(0), slice(0, 0))
