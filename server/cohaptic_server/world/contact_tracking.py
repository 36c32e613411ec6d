"""The contact of one user in this tick, and the force that it requests there."""

from __future__ import annotations

import numpy as np

from cohaptic.control.delay import UNKNOWN, LoopDelay
from cohaptic.control.friction import stretch_of, tangential
from cohaptic.control.stability.lag_choice import SHARE, kept, lag_needed
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
# A contact that others turn so far that it slips off has no time constant of its own; this one is
# as long as a hand takes to let go and come back.
LONGEST_TURN = 2.0  # s
# Largest gain of that kind without a lag: a nearest point on a probe a quarter as deep as the
# surface is curved, as in `displacement_field.LARGEST_PRODUCT`. The material under a contact on a
# limb gives way sideways up to three times as far as along the normal.
LARGEST_TURN = 1.0 / 3.0
_GENTLE = 1.0 / (1.0 + LARGEST_TURN)  # slope from which on a contact turns without a lag


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
    followed = _followed(body.mesh, previous, _share_followed(state, previous, time.period))
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


def turning_lag(slope: float, longest_delay: float) -> float:
    """Time constant with which others may turn a contact (science 3.12) [s].

    A probe at depth d under a surface of curvature k has its nearest point d k / (1 - d k) times as
    far round as the surface moves sideways under it. That is a gain in the loop of several hands
    which C does not have. Below `LARGEST_TURN` it does no harm; beyond, the turning gets the lag
    that the theorem gives the forces.

    Args:
        slope: 1 - d k of the contact.
        longest_delay: T_max of the room [s].
    """
    gain = (1.0 - slope) / slope / LARGEST_TURN
    return min(LONGEST_TURN, lag_needed(gain, longest_delay) / SHARE)


def _share_followed(state: WorldState, previous: UserState | None, dt: float) -> float:
    """Share of the body's change that the surface follows on which a contact is tracked."""
    if previous is None or len(state.users) < 2 or previous.contact.slope >= _GENTLE:
        return RELAXATION  # nobody else turns it, or not far
    # As for the room's lag: with the client's way into a new patch, and without who is too slow.
    delays = [user.delay.counted for user in state.users.values() if not user.delay.too_long]
    longest = max(delays, default=0.0) + dt
    return min(RELAXATION, 1.0 - kept(turning_lag(previous.contact.slope, longest), dt))


def _followed(mesh: SurfaceMesh, previous: UserState | None, share: float) -> CachedField | None:
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
    field.follow(free.vertices, free.values, share, values)
    return CachedField(free.vertices, values, free.elsewhere)


def _previous_free_field(state: WorldState, previous: UserState | None) -> Field:
    """Displacement of the last tick without the user's own force."""
    if previous is not None and previous.free is not None:
        return previous.free
    if state.response is None:
        return ZeroField()
    return FreeField(state.response, np.zeros(0), slice(0, 0))
