"""Advances the world by one simulation period: takes forces, returns patches. No I/O.

A tick has five steps:

1. find each contact on the user's free surface (`contact_tracking.py`);
2. decide the forces that the body gets from those that users request (`applied_forces.py`);
3. let the body respond to all forces at once;
4. compute the free surface round each contact (`patch_geometry.py`, `displacement_field.py`);
5. choose the lags of the next tick (`lags/`) and the share of the body's swing that hands feel in
   the next tick (science 3.14), and build one patch per user: the free surface and the body's
   stiffness at the user's contact, and the gains of the client's control law.

Each step is one call for all users, over the arrays of `users.py` (docs/design/wire.md).

The force of a user who has left, or whose samples have stopped, fades over `RELEASE_TIME`, so that
a pulled cable makes no other user's force jump. When no user, response or fading force is left, the
world is at rest, and a tick without touches changes only its number (`users.settled`).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from cohaptic.control.delay import TOO_LONG
from cohaptic.control.friction import Compliance3
from cohaptic.control.gains import choose_gains
from cohaptic.control.room_lag import RoomLag
from cohaptic.control.stability.anticipation import Gains, hand_class
from cohaptic.control.stability.swing import felt_share
from cohaptic.protocol.partners import Partners
from cohaptic.protocol.patch import Patch
from cohaptic.vec import Vec3
from cohaptic_server.bodies.body import Body, Response, Swings, is_linear, without_own
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.applied_forces import apply_forces, remember, update_releases
from cohaptic_server.world.contact import MAX_CONTACT_HEIGHT
from cohaptic_server.world.contact_tracking import track_contacts
from cohaptic_server.world.displacement_field import FreeField, KnownFields, flatten_bulges
from cohaptic_server.world.lags.planning import (
    CALM_TIME,
    find_anticipation,
    find_lag,
    known_coupling,
)
from cohaptic_server.world.lags.room_loop import hand_stiffness, room_loop, takes_part
from cohaptic_server.world.lags.turning import find_turning_lag, steep_contacts, turned_loop
from cohaptic_server.world.loads import (
    bounded,
    compliance_between,
    contact_compliance,
    loads_of,
    without_tangents,
)
from cohaptic_server.world.loops.free_surfaces import put_contacts
from cohaptic_server.world.loops.vectors import heights, tangential_parts
from cohaptic_server.world.partners.wishes import (
    NO_PARTNERS,
    held_beside,
    moves_models,
    next_wishes,
    partners_of,
)
from cohaptic_server.world.patch_geometry import NO_WINDOWS, choose_windows, free_shapes
from cohaptic_server.world.state import NEGLIGIBLE, TickTime, Touch
from cohaptic_server.world.users import (
    Applied,
    Hand,
    Observed,
    Tracked,
    Users,
    WorldState,
    is_at_rest,
    pass_over,
    settled,
)

NEAR_HEIGHT = 0.005  # m above the surface; a probe below it counts fully as a neighbour


def nearness(height: Floats, force: Floats) -> Floats:
    """Return the weight of each user as a neighbour, shape (n,): 1 in contact, 0 out of reach.

    The gains of the paper's laws and the felt share of a swing must not step when a hand touches.
    The room's lag may, so only users who press count there (`lags/room_loop.py`).

    Args:
        height: Height of each probe over the user's free surface, shape (n,) [m].
        force: Normal force of each user that the body carries, shape (n,) [N].
    """
    fade = (MAX_CONTACT_HEIGHT - height) / (MAX_CONTACT_HEIGHT - NEAR_HEIGHT)
    return np.where(force > NEGLIGIBLE, 1.0, np.fmin(1.0, np.fmax(0.0, fade)))


def build_patches(
    touched_body: TouchedBody,
    users: Tracked,
    applied: Applied,
    observed: Observed,
    connected: Collection[int],
    rows: Sequence[Sequence[float]],
    delays: Sequence[float],
    compliance: Sequence[Compliance3 | None],
    partners: Mapping[int, Partners],
    stiffest: Sequence[float],
    room: RoomLag,
    time: TickTime,
) -> dict[int, Patch]:
    """Build the patch of each connected user, with the geometry that its client requests.

    Args:
        touched_body: The deformable object and its touch mesh.
        connected: Numbers of the users who get a patch.
        rows: Compliance matrix between users for the choice of gains, with the entries of other
            users weighted by nearness, shape (n, n) [m/N].
        delays: Loop delay of each user, without the room's lag [s].
        compliance: 3x3 compliance of each contact; None without friction.
        partners: The other hands, for each user whose client moves models.
        stiffest: Largest gain of each user's law [N/m].
    """
    frames, x_free = users.contacts.frames, observed.x_free
    normals = np.ascontiguousarray(frames[:, 2])
    curvatures, neighbourhoods = free_shapes(
        touched_body, observed.windows, observed.free, x_free, normals
    )
    own = applied.force[:, None] * normals
    if users.rough:
        own += applied.tangential
    places, normal, force = _tuples(x_free), _tuples(normals), _tuples(own)
    by_others, curved = _tuples(x_free - frames[:, 1]), curvatures.tolist()
    patches: dict[int, Patch] = {}
    for i, (touch, delay) in enumerate(zip(users.touches, delays, strict=True)):
        if touch.user not in connected:
            continue
        gains = choose_gains(
            touch.law,
            rows[i],
            i,
            max_stiffness=stiffest[i],
            # The room's lag is part of the loop of the paper's laws.
            loop_delay=delay + room.lag,
            simulation_period=time.period,
            fixed=touch.fixed_gains,
        )
        # Arguments by position: keywords would take twice as long.
        patches[touch.user] = Patch(
            time.number, touch.seq, time.now, touch.t_client, max(0.0, time.now - touch.arrived),
            touch.geometry, touch.law, places[i], normal[i], curved[i], rows[i][i], gains.k_h,
            gains.integral_gain, force[i], by_others[i], room, neighbourhoods[i], compliance[i],
            partners.get(touch.user),
        )  # fmt: skip
    return patches


def _tuples(vectors: Floats) -> list[Vec3]:
    """Return vectors of shape (n, 3) as tuples of Python floats."""
    return list(zip(*vectors.T.tolist(), strict=True))


# Rates at which the felt share of the swing may rise and fall [1/s]. A change of the share moves
# surfaces under fingers, and a fall has to be complete before the hands in the room have answered.
_RISE, _FALL = 1.0, 10.0


def show_swing(
    body: Swings,
    response: Response,
    users: Sequence[Hand],
    near: Sequence[float],
    gains: Gains | None,
    lag: float,
    compliance: Floats,
    spans: Sequence[slice],
    starts: Sequence[int],
    dt: float,
) -> Response:
    """Choose the share of the body's swing that hands feel in the next tick.

    The swing is the deviation of the body's natural modes from their static amplitudes.

    Args:
        body: The object, which has mass.
        response: Response of this tick.
        users: Users with their newest samples and measured delays.
        near: Weight of each user as a neighbour, 0 to 1.
        gains: Gains of the loop that anticipation leaves; None if the coupling cannot be
            anticipated, and the share is 0. The share is also 0 if a near hand has a law of
            the paper: it answers its own dent a delay later, and may have no gain for a swing.
        lag: Lag of the room [s].
        compliance: Compliance between the loads of the loop, shape (loads, loads) [m/N].
        spans: Span of each user's loads in `compliance`.
        starts: First load of each user in the response.
        dt: Time since the last tick [s].

    Returns:
        The response with the chosen share; the same response if it has no swing.
    """
    swinging = body.swinging(response)
    if swinging is None:
        return response
    share, stiffest, budget, papers = 0.0, 0.0, np.inf, False
    parts = np.zeros((swinging.along.shape[1],) * 2)
    for user, weight, span, start in zip(users, near, spans, starts, strict=False):
        if weight <= 0.0 or not takes_part(user):
            continue
        budget = min(budget, user.touch.damping_budget)
        papers = papers or user.touch.law.answers_own_dent
        K = hand_stiffness(user, compliance[span, span])
        stiffest = max(stiffest, float(np.abs(K).sum(axis=1).max()))
        along = swinging.along[start : start + len(K)]
        parts += along.T @ K @ along
    if gains is not None and not papers:
        theta, stiffness = hand_class(budget, stiffest)
        taken = float(np.linalg.eigvalsh(parts)[-1])
        share = felt_share(gains, theta, stiffness, lag, taken, body.swing)
    before = swinging.felt
    return swinging.showing(min(before + _RISE * dt, max(before - _FALL * dt, share)))


RELEASE_TIME = 0.3  # s; a hand that lets go on purpose takes about as long
PREFETCH_TIME = 0.2  # s; vertices are announced to a body this long before a finger reaches them
# Range of slides within `PREFETCH_TIME`, in contact radii, for which vertices are announced. Below
# it, the finger stays nearly where it is; above it, the finger has left before the body could use
# the vertices.
_SLOWEST_SLIDE, _FASTEST_SLIDE = 0.1, 1.0
# A contact that moves further than both of these in a tick was not moved by a hand.
_MAX_STEP = 0.03  # m
_MAX_SPEED = 1.5  # m/s, the speed at which a client's safety layer lets go
# Periods; a server that stood still for longer has not computed what would have happened meanwhile.
_LONGEST_TICK = 4.0
_SHORTEST_TICK = 0.1  # filters divide by a time


# The five steps in their order, each of which needs the arrays of those before it.
def advance(
    touched_body: TouchedBody,
    state: WorldState,
    touches: Iterable[Touch],
    *,
    now: float,
    dt: float,
    elapsed: float | None = None,
) -> tuple[WorldState, dict[int, Patch]]:
    """Advance the world by one simulation tick.

    Args:
        touched_body: The deformable object and its touch mesh.
        state: The world after the last tick.
        touches: Newest sample of every connected user who has sent one.
        now: Time of this tick on the server's clock [s].
        dt: Simulation period N T [s].
        elapsed: Time since the last tick [s]; None for a tick on time. Whatever moves with time
            moves by this, so that a late tick changes nothing but the times at which hands see it.
            A body with a memory has its own constant period.

    Returns:
        The world after this tick, and a patch for each of `touches`, by user.
    """
    connected = {touch.user: touch for touch in touches}
    if not connected and is_at_rest(state):
        return pass_over(state, 1), {}
    body = touched_body.body
    elapsed = dt if elapsed is None else max(_SHORTEST_TICK * dt, min(_LONGEST_TICK * dt, elapsed))
    time = TickTime(state.tick + 1, now, dt, elapsed)
    fade, max_move = elapsed / RELEASE_TIME, _max_contact_move(body, elapsed)

    tracked = track_contacts(body, state, *_participants(state, connected, fade), time)
    releases = update_releases(state, tracked, fade, max_move=max_move)
    released = {release.user for release in releases}
    applied = apply_forces(body, state, tracked, released, elapsed, max_move=max_move)

    fading = [release.faded() for release in releases]
    # Steep contacts need the body's response in two more directions, along the surface.
    turns = steep_contacts(tracked.contacts.slopes)
    steep = [i for i in turns if i not in tracked.rough]
    wide = sorted([*tracked.rough, *steep])
    loads, starts = loads_of(tracked.contacts, applied.force, applied.tangential, wide, fading)
    if (prefetching := touched_body.prefetching) is not None:
        prefetching.prefetch(_vertices_ahead(body, tracked))
    response = body.respond(loads, state.response)

    own = loads.arrays.forces[: starts[-1]]
    delays = [delay.value for delay in tracked.delays]
    # A patch is used until the patch that answers the next sample has arrived, and for one more
    # period, in which the client's loop blends into the new patch.
    horizons = np.array(delays, dtype=np.float64) + 2.0 * dt
    observed, height = _observe(
        touched_body, state.users.observed, tracked, horizons, response, starts, own
    )
    wide_spans = [slice(a, b) for a, b in pairwise(starts.tolist())]
    compliance, spans = without_tangents(response.compliance, wide_spans, steep)
    compliance = bounded(compliance, spans)
    coupling = compliance_between(compliance, spans)
    weight = nearness(height, applied.force)
    hands = list(map(Hand, tracked.touches, tracked.delays))
    pressing = applied.force > NEGLIGIBLE
    loop = room_loop(hands, compliance, spans, pressing, dt)
    turned = None
    if turns:
        turned = turned_loop(
            hands, response.compliance, wide_spans, tracked.contacts, body.mesh, pressing
        )
    S = known_coupling(loop, turned)
    # A hand with a law of the paper may come and go in every tick, as contacts at a limit may.
    unknown_at = now if S is None or loop.papers else state.unknown_at
    if now - unknown_at < CALM_TIME:
        S = None
    plan = find_anticipation(loop, tracked.contacts.normals, S, turned, dt)
    past = remember(state.past, time, tracked, applied, math.ceil(TOO_LONG / dt) + 1)
    room, cause = find_lag(loop, plan, state.room, state.cause, elapsed)
    if touched_body.swings is not None:
        response = show_swing(
            touched_body.swings, response, hands, weight.tolist(), plan.gains, room.lag, compliance,
            spans, starts.tolist(), elapsed,
        )  # fmt: skip
    # Where forces are anticipated, contacts turn at once, as the anticipation assumes.
    turning = find_turning_lag(None if plan.gains else turned, loop.longest_delay, room.lag)

    wishes, partners, stiffest = state.wishes, NO_PARTNERS, tracked.settings[1]
    if wishes.hands or moves_models(tracked):
        normals = np.array([span.start for span in spans], dtype=np.int64)
        C = compliance[np.ix_(normals, normals)]
        linear = not turns and is_linear(body)
        beside = held_beside(tracked, wishes, pressing, C)
        stiffest = 1.0 / (1.0 / stiffest + beside)
        wishes = next_wishes(wishes, tracked, applied, height, C, stiffest, linear, time)
        partners = partners_of(wishes, tracked, applied, weight, C, stiffest, body.mesh.size)
    weighted = _weighted_rows(coupling, weight)
    of_contacts: list[Compliance3 | None] = [None] * len(spans)
    for i in tracked.rough:
        of_contacts[i] = contact_compliance(compliance, tracked.contacts.frames[i, 2], spans[i])
    patches = build_patches(
        touched_body, tracked, applied, observed, connected, weighted.tolist(), delays, of_contacts,
        partners, stiffest.tolist(), room, time,
    )  # fmt: skip
    k_o_coupled = (1.0 / np.abs(weighted).sum(axis=1)).tolist()
    users = Users(tracked, applied, observed, of_contacts, k_o_coupled)
    after = WorldState(
        time.number, users, response, releases, room, coupling, turning, plan.anticipation, past,
        unknown_at, cause, wishes,
    )  # fmt: skip
    return settled(after, now), patches


def _participants(
    state: WorldState, connected: Mapping[int, Touch], fade: float
) -> tuple[list[Touch], Ints, Floats]:
    """Return samples, rows in the last tick, and presence of the users who take part in this tick.

    The presence of a user is the share of its force that counts. It rises towards 1 by `fade` if
    samples arrive and the user's loop is not too slow, and falls towards 0 otherwise.
    """
    last, applied = state.users.tracked, state.users.applied
    touches: list[Touch] = [
        connected.get(old.user) or replace(old, fresh=False) for old in last.touches
    ]
    rises = [
        touch.fresh and not delay.too_long
        for touch, delay in zip(touches, last.delays, strict=True)
    ]
    presence = applied.presence + np.where(rises, fade, -fade)
    if state.releases:
        fading = {release.user for release in state.releases}
        # A user does not press until the force at its previous contact has faded.
        presence[[touch.user in fading for touch in touches]] = 0.0
    rows = np.arange(len(touches))
    stays = (presence > 0.0) | (applied.force > NEGLIGIBLE)
    if not stays.all():
        stays |= np.array([touch.user in connected for touch in touches])
        rows, presence = rows[stays], presence[stays]
        touches = [touches[row] for row in rows.tolist()]
    known = {old.user for old in last.touches}
    if new := [touch for number, touch in connected.items() if number not in known]:
        touches += new
        rows = np.concatenate([rows, np.full(len(new), -1)])
        presence = np.concatenate([presence, np.full(len(new), fade)])
    return touches, rows, np.minimum(1.0, np.maximum(0.0, presence))


def _max_contact_move(body: Body, dt: float) -> float:
    """Return the largest distance that a hand can move a contact in a tick [m]."""
    return max(_MAX_STEP, _MAX_SPEED * dt) + body.contact_radius


def _vertices_ahead(body: Body, users: Tracked) -> Ints:
    """Return the vertices that sliding fingers will reach within `PREFETCH_TIME`, shape (k,)."""
    frames, slides = users.contacts.frames, np.empty_like(users.velocity)
    tangential_parts(frames, PREFETCH_TIME * users.velocity, slides)
    lengths = np.sqrt((slides * slides).sum(axis=1)) / body.contact_radius
    vertices = [np.zeros(0, dtype=np.int64)]
    for i in np.flatnonzero((_SLOWEST_SLIDE < lengths) & (lengths < _FASTEST_SLIDE)).tolist():
        vertices.append(body.mesh.near(frames[i, 0] + slides[i], body.contact_radius))
    return np.concatenate(vertices)


def _weighted_rows(coupling: Floats, weight: Floats) -> Floats:
    """Return the compliance between users, entries off the diagonal weighted by nearness [m/N]."""
    rows = coupling * weight
    rows.reshape(-1)[:: len(rows) + 1] = coupling.diagonal()
    return rows


def _observe(
    touched_body: TouchedBody,
    last: Observed | None,
    users: Tracked,
    horizons: Floats,
    response: Response,
    spans: Ints,
    forces: Floats,
) -> tuple[Observed, Floats]:
    """Compute each user's free surface round its contact (science 3.3).

    Args:
        touched_body: The deformable object and its touch mesh.
        last: Free surfaces of the last tick; None before the first tick.
        horizons: Time for which the patches will be in use, shape (n,) [s].
        response: Response of the body to all loads.
        spans: First load of each user, and the end of the last user's loads, shape (n + 1,).
        forces: Forces of these loads, shape (l,) [N].

    Returns:
        The free surfaces, and the height of each probe over its user's surface, shape (n,) [m].
    """
    mesh, contacts, n = touched_body.body.mesh, users.contacts, len(users.touches)
    windows = choose_windows(
        touched_body,
        [touch.geometry for touch in users.touches],
        contacts,
        users.velocity,
        horizons,
        np.full(n, -1) if last is None else users.before,
        NO_WINDOWS if last is None else last.windows,
    )
    known = windows.starts[0]
    vertices, x_free = windows.vertices[: known[n]], np.empty((n, 3))
    free = without_own(response, spans, forces, known, vertices)
    search, user = mesh.contacts, 0
    while True:
        user = put_contacts(
            search.search, search.field, user, contacts.frames, contacts.starts, contacts.vertices,
            contacts.weights, known, vertices, free, x_free,
        )  # fmt: skip
        if user == n:
            break
        a, b = spans[user : user + 2].tolist()
        elsewhere = FreeField(response, forces[a:b], slice(a, b))
        x_free[user] = contacts.at(user).moved(elsewhere)
        user += 1
    height, shown = np.empty(n), None
    heights(contacts.frames, users.probes, x_free, height)
    if n > 1:  # no other user bulges the surface of a user alone
        shown = flatten_bulges(
            mesh, KnownFields(known, vertices, free), contacts.frames, x_free, -height,
            touched_body.body.contact_radius,
        )  # fmt: skip
    return Observed(response, spans, forces, windows, free, shown, x_free), height
