"""The contact of one user in this tick, and the force that it requests there."""

from __future__ import annotations

import numpy as np

from cohaptic.control.delay import UNKNOWN, LoopDelay
from cohaptic.control.friction import stretch_of, tangential
from cohaptic.vec import ZERO, Vec3, add, dot, scale, sub
from cohaptic_server.bodies.body import Body
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import MAX_CONTACT_HEIGHT, locate, place_on
from cohaptic_server.world.displacement_field import CachedField, Field, FreeField, ZeroField
from cohaptic_server.world.state import TickTime, Touch, UserState, WorldState

_MIN_SAMPLE_INTERVAL = 0.001  # s; two samples closer than this give no velocity
_VELOCITY_SMOOTHING = 0.3  # weight of the newest velocity in the running mean
# Relaxation factor of the surface on which a contact is tracked: the share of the body's change of
# one tick that it follows. If it followed all of it, several contacts on a body that softens under
# load would each slide to where the last tick's forces took the surface and push each other to and
# fro; `equilibrium` takes half steps for the same reason.
RELAXATION = 0.5


def track_contact(
    body: Body, state: WorldState, touch: Touch, presence: float, time: TickTime
) -> UserState:
    """Find the contact on the surface of the last tick, and the force requested there.

    Args:
        body: The deformable object.
        state: The world after the last tick.
        touch: Newest sample of this user.
        presence: Share of its force that counts, 0 to 1.
        time: Of this tick.

    Returns:
        The user with its requested force; the applied force is zero until `apply_forces`.
    """
    previous = state.users.get(touch.user)
    free = _previous_free_field(state, previous)
    followed = _followed(body.mesh, previous)
    contact = locate(
        body.mesh,
        _material_tip(touch, previous),
        free if followed is None else followed,
        radius=body.contact_radius,
        hint=None if previous is None else previous.contact,
    )
    normal = contact.places[2]
    height = dot(normal, sub(touch.probe, place_on(body.mesh, contact, free)))
    pressed = min(touch.max_force, max(0.0, dot(normal, touch.force)))
    requested = presence * pressed if height < MAX_CONTACT_HEIGHT else 0.0
    friction: Floats | None = None
    if touch.friction:
        friction = np.array(tangential(scale(touch.force, presence), normal, requested))
    return UserState(
        touch=touch,
        contact=contact,
        presence=presence,
        force=0.0,
        requested=requested,
        requested_tangential=friction,
        delay=_loop_delay(state, previous, touch, time),
        velocity=_velocity(previous, touch),
        surface=followed,
    )


def _material_tip(touch: Touch, previous: UserState | None) -> Vec3:
    """The tip, less the stretch of the material under it along the free surface [m].

    A tangential force carries the material with it, which the free surface does not show. A finger
    that sticks must stay on its material point however far both have moved (science 3.10).
    """
    if not touch.friction or previous is None or previous.compliance is None:
        return touch.probe
    normal = previous.contact.places[2]
    return sub(touch.probe, stretch_of(touch.force, normal, previous.compliance))


def _velocity(previous: UserState | None, touch: Touch) -> Vec3:
    """Smoothed velocity of the probe [m/s]; it tells how far a patch has to reach."""
    if previous is None:
        return ZERO
    interval = touch.t_client - previous.touch.t_client
    if interval < _MIN_SAMPLE_INTERVAL:
        return previous.velocity if touch.fresh else ZERO
    newest = scale(sub(touch.probe, previous.touch.probe), 1.0 / interval)
    before = previous.velocity
    return add(before, scale(sub(newest, before), _VELOCITY_SMOOTHING))


def _loop_delay(
    state: WorldState, previous: UserState | None, touch: Touch, time: TickTime
) -> LoopDelay:
    """Loop delay of a user in this tick: the age of the patch that its force answers.

    A force that is held because no newer sample arrives grows older tick by tick, and so does the
    delay.
    """
    delay = LoopDelay() if previous is None else previous.delay
    if not touch.fresh or touch.tick > state.tick:
        return delay
    if touch.tick > 0:
        return delay.measured((time.number - touch.tick) * time.period, time.now)
    # Before its first patch a client can name none. If it names none after a full fade-in, it does
    # not answer our patches at all, and its loop may have any delay.
    late = previous is not None and previous.presence >= 1.0
    return delay.measured(UNKNOWN, time.now) if late else delay


def _followed(mesh: SurfaceMesh, previous: UserState | None) -> CachedField | None:
    """The tracking surface after one relaxation step towards the free surface of the body.

    A vertex that the surface did not have begins on the body's; none before the first contact.
    """
    if previous is None or previous.free is None:
        return None
    surface, free = previous.surface, previous.free
    if surface is None:
        return free
    values = np.empty_like(free.values)
    field = mesh.contacts.field
    field.load(surface.vertices, surface.values, False)
    field.follow(free.vertices, free.values, RELAXATION, values)
    return CachedField(free.vertices, values, free.elsewhere)


def _previous_free_field(state: WorldState, previous: UserState | None) -> Field:
    """Displacement of the last tick without the user's own force."""
    if previous is not None and previous.free is not None:
        return previous.free
    if state.response is None:
        return ZeroField()
    return FreeField(state.response, np.zeros(0), slice(0, 0))
