"""Find the contacts of all users in a tick, and the forces that users request at them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cohaptic.control.delay import TOO_LONG, LoopDelay
from cohaptic.control.friction import tangential
from cohaptic.control.stability.lag_choice import kept
from cohaptic.vec import ZERO, scale
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats, Ints, vec3
from cohaptic_server.world.contact import (
    KEEP_DISTANCE,
    MAX_CONTACT_HEIGHT,
    TOLERANCE,
    Contacts,
    locate,
    place_on,
)
from cohaptic_server.world.displacement_field import (
    NOWHERE_KNOWN,
    CachedField,
    Field,
    KnownFields,
)
from cohaptic_server.world.lags.turning import steep_contacts
from cohaptic_server.world.loops.rows import ContactRows, FieldRows
from cohaptic_server.world.loops.tracking import Reach, track
from cohaptic_server.world.loops.vectors import heights, pressed, smoothed
from cohaptic_server.world.state import Carried, TickTime, Touch
from cohaptic_server.world.users import Tracked, WorldState, settings_of, vectors

# s; two samples closer than this give no velocity: a haptic period at 1 kHz, within which a tip has
# not been measured twice. Reasoned, not measured.
_MIN_SAMPLE_INTERVAL = 0.001
# Weight of the newest velocity in the running mean, which is then of the last 3 samples or so: it
# only says which way a hand slides. Reasoned, not measured.
_VELOCITY_SMOOTHING = 0.3
# A contact is tracked on a surface that follows only this share of the body's change in a tick. If
# the tracked surface followed all of the change, several contacts on a body that softens under load
# would each slide to where the last tick's forces took the surface, and would push each other to
# and fro; `equilibrium` takes half steps for the same reason. The half is reasoned, not measured.
RELAXATION = 0.5
_NOT_MEASURED = LoopDelay()
_USUAL = 48  # vertices under a contact for which arrays have room at first; they grow where needed


def track_contacts(
    body: Body,
    state: WorldState,
    touches: Sequence[Touch],
    before: Ints,
    presence: Floats,
    time: TickTime,
) -> Tracked:
    """Find each user's contact on the surface of the last tick, and the force requested there.

    Args:
        body: The deformable object.
        state: The world after the last tick.
        touches: Newest samples of the users, n of them.
        before: Row of each user in the last tick; -1 for a user who was not there, shape (n,).
        presence: Share of each user's force that counts, 0 to 1, shape (n,).
        time: Number, time and period of this tick.
    """
    probes, settings = vectors([touch.probe for touch in touches]), settings_of(touches)
    frictional = [i for i, touch in enumerate(touches) if touch.who.friction]
    followed = _places_to_follow(state, touches, before, probes)
    contacts, surfaces, places = _follow(body, state, before, followed, time.elapsed)
    n, frames = len(touches), contacts.frames
    height, push, velocity = np.empty(n), np.empty(n), np.empty((n, 3))
    heights(frames, probes, places, height)
    pressed(frames, vectors([touch.force for touch in touches]), settings[0], push)
    requested = np.where(height < MAX_CONTACT_HEIGHT, presence * push, 0.0)
    sideways = np.zeros((n, 3))
    for i in frictional:
        fraction = scale(touches[i].force, float(presence[i]))
        sideways[i] = tangential(fraction, vec3(frames[i, 2]), float(requested[i]))
    last = state.users.tracked
    smoothed(
        before, probes, last.probes, last.velocity, settings[2], last.settings[2], settings[3],
        _MIN_SAMPLE_INTERVAL, _VELOCITY_SMOOTHING, velocity,
    )  # fmt: skip
    delays = _loop_delays(state, touches, before, time)
    return Tracked(
        touches, before, probes, settings, contacts, presence, requested, sideways, frictional,
        delays, velocity, push, surfaces,
    )  # fmt: skip


def _follow(
    body: Body, state: WorldState, before: Ints, tips: Floats, dt: float
) -> tuple[Contacts, KnownFields, Floats]:
    """Find each contact on its tracked surface, in a search that starts at the last tick's contact.

    Returns:
        The contacts; the tracked surfaces, one for each row of the last tick; and the contact
        points on the free surfaces, shape (n, 3) [m].
    """
    n, last, found = len(tips), state.users.tracked, body.mesh.contacts
    observed, old = state.users.observed, last.contacts
    if observed is None:  # no contact is followed without a field
        known, there = NOWHERE_KNOWN, np.full(n, -1)
    else:
        windows = observed.windows
        known, there = KnownFields(windows.starts[0], windows.vertices, observed.free), before
    surfaces = KnownFields(known.starts, known.vertices, np.empty_like(known.values))
    fractions = _fractions_followed(state, before, dt)
    room = max(_USUAL * n, 5 * int(old.starts[-1]) // 4)
    contacts = Contacts(
        np.empty((n, 3, 3)), np.empty(n), np.zeros(n + 1, np.int64), np.empty(room, np.int64),
        np.empty(room),
    )  # fmt: skip
    places = np.empty((n, 3))
    reach = Reach(body.contact_radius, KEEP_DISTANCE, TOLERANCE)
    old_rows, free_rows, surface_rows = (
        ContactRows(*old), FieldRows(*known), FieldRows(*last.surfaces),
    )  # fmt: skip
    user = 0
    while True:
        user = track(
            found.search, found.field, user, there, tips, fractions, reach, old_rows, free_rows,
            last.before, surface_rows, surfaces.values, ContactRows(*contacts), places,
        )  # fmt: skip
        if user == n:
            return contacts, surfaces, places
        row = int(before[user])
        free, hint = state.free_field(row), old.contact(row) if row >= 0 else None
        on: Field = free
        if isinstance(free, CachedField):
            a, b = surfaces.starts[row : row + 2].tolist()
            on = CachedField(surfaces.vertices[a:b], surfaces.values[a:b], free.elsewhere)
        contact = locate(body.mesh, tips[user], on, radius=body.contact_radius, hint=hint)
        places[user] = place_on(body.mesh, contact, free)
        contacts = contacts.put(user, contact)
        user += 1


def _places_to_follow(
    state: WorldState, touches: Sequence[Touch], before: Ints, probes: Floats
) -> Floats:
    """Return the point to which each contact is the nearest one on the surface, shape (n, 3) [m].

    The point is the probe's tip, except for a finger that sticks. That finger must stay on its
    material point, however far all forces have moved finger and point, and although the surface may
    turn under the finger (science 3.10). Its point is therefore the finger's anchor, displaced as
    the other users have displaced the contact point.
    """
    held = [i for i, touch in enumerate(touches) if touch.anchor is not None and before[i] >= 0]
    observed = state.users.observed
    if not held or observed is None:
        return probes
    rows, places = before[held], probes.copy()
    displaced = observed.x_free[rows] - state.users.tracked.contacts.frames[rows, 1]
    places[held] = vectors([touches[i].anchor or ZERO for i in held]) + displaced
    return places


def _loop_delays(
    state: WorldState, touches: Sequence[Touch], before: Ints, time: TickTime
) -> list[LoopDelay]:
    delays = state.users.tracked.delays
    presence: list[float] = state.users.applied.presence.tolist()
    rows: list[int] = before.tolist()
    return [
        _loop_delay(state, touch, _NOT_MEASURED, False, time)
        if row < 0
        else _loop_delay(state, touch, delays[row], presence[row] >= 1.0, time)
        for touch, row in zip(touches, rows, strict=True)
    ]


def _loop_delay(
    state: WorldState, touch: Touch, delay: LoopDelay, faded_in: bool, time: TickTime
) -> LoopDelay:
    """Return the user's loop delay, updated by the age of the patch that the user's force answers.

    Without a newer sample, a user's force is held and answers an older patch in each tick, so that
    the delay grows.
    """
    named = 0 < touch.tick <= state.tick
    if not touch.fresh:
        if not named:
            return delay
        return delay.unheard(since(state.past, touch.tick, time), time.elapsed)
    if named:
        late = since(state.past, touch.tick, time)
        # The first sample after an outage names a patch from before, which does not time the loop.
        counts = faded_in or late <= TOO_LONG
        return delay.measured(late, time.now, time.elapsed) if counts else delay
    # The sample names no patch, since there was none yet, or a patch that was never made.
    return delay.waited(time.elapsed) if faded_in else delay


def since(past: Sequence[Carried], tick: int, time: TickTime) -> float:
    """Return the time from an earlier tick to this one, as far as it counts [s].

    Args:
        past: Ticks that are remembered, oldest first.
        tick: Its number.
        time: This tick.
    """
    back = time.number - tick
    # Ticks without users leave no trace.
    if back <= len(past) and past[-back].tick == tick:
        return time.elapsed + 1e-9 * (past[-1].at - past[-back].at)
    return back * time.period


def _fractions_followed(state: WorldState, before: Ints, dt: float) -> Floats:
    """Return the share of the body's change that each tracked surface follows, shape (n,)."""
    fractions = np.full(len(before), RELAXATION)
    if state.turning > 0.0:
        slow = min(RELAXATION, 1.0 - kept(state.turning, dt))
        for i in steep_contacts(state.users.tracked.contacts.slopes):
            fractions[before == i] = slow
    return fractions
