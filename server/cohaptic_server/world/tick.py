"""One simulation period of the world: forces in, patches out. No I/O.

A tick has five steps:

1. track each contact on the surface free of its own force (`contact_tracking.py`);
2. decide which forces the body gets of those that users request (`applied_forces.py`);
3. let the body respond to all of them at once;
4. evaluate the free surface round each contact (`patch_geometry.py`, `displacement_field.py`);
5. choose the room's lag (`room_lag.py`) and build one patch per user (`patch.py`).

The force of a user who has left, or whose samples have stopped, fades over `RELEASE_TIME`, so that
a pulled cable makes nobody else's force jump.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from cohaptic.protocol.patch import Patch
from cohaptic.vec import add, dot, norm, scale, sub
from cohaptic_server.bodies.body import Body, Load, Response
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.applied_forces import apply_forces, update_releases
from cohaptic_server.world.contact import place_on
from cohaptic_server.world.contact_tracking import track_contact
from cohaptic_server.world.displacement_field import CachedField, FreeField, flattened
from cohaptic_server.world.loads import (
    bounded,
    compliance_between,
    contact_compliance,
    load_spans,
)
from cohaptic_server.world.patch import build_patch, nearness
from cohaptic_server.world.patch_geometry import choose_window
from cohaptic_server.world.room_lag import find_lag
from cohaptic_server.world.state import (
    NEGLIGIBLE,
    TickTime,
    Touch,
    UserState,
    UserTick,
    WorldState,
)

RELEASE_TIME = 0.3  # s; a hand that lets go on purpose takes about as long
PREFETCH_TIME = 0.2  # s; a body is told of vertices this long before a finger reaches them
# Contact radii that a finger slides within `PREFETCH_TIME`. Below the range it presses where it
# is; above it, it has moved on before the body could have used the news.
_SLOWEST_SLIDE, _FASTEST_SLIDE = 0.1, 1.0
# A contact that moves further than both of these in a tick was not moved by a hand.
_MAX_STEP = 0.03  # m
_MAX_SPEED = 1.5  # m/s, the speed at which a client's safety layer lets go


def advance(
    touched_body: TouchedBody,
    state: WorldState,
    touches: Iterable[Touch],
    *,
    now: float,
    dt: float,
) -> tuple[WorldState, dict[int, Patch]]:
    """Advance the world by one simulation tick.

    Args:
        touched_body: The deformable object and its touch mesh.
        state: The world after the last tick.
        touches: One for every connected user who has sent a sample.
        now: Time of this tick on the server's clock [s].
        dt: Simulation period N T [s].

    Returns:
        The world after this tick, and a patch for each of `touches`, by user.
    """
    body = touched_body.body
    time = TickTime(state.tick + 1, now, dt)
    connected = {touch.user: touch for touch in touches}
    fade, max_move = dt / RELEASE_TIME, _max_contact_move(body, dt)

    taking_part = _participants(state, connected, fade)
    tracked = [track_contact(body, state, p.touch, p.presence, time) for p in taking_part]
    releases = update_releases(state, tracked, fade, max_move=max_move)
    released = {release.user for release in releases}
    users = apply_forces(body, state, tracked, released, dt, max_move=max_move)

    own_loads = [user.press.loads() for user in users]
    fading_loads = [release.faded().loads() for release in releases]
    prefetching = touched_body.prefetching
    if prefetching is not None:
        prefetching.prefetch(_vertices_ahead(body, users))
    response = body.respond(_flat([*own_loads, *fading_loads]), state.response)

    observed = _observe(touched_body, state, users, own_loads, response, dt)
    spans = [user.loads for user in observed]
    compliance = bounded(response.compliance, spans)
    coupling = compliance_between(compliance, spans)
    weight = np.array([user.nearness for user in observed])
    room = find_lag(users, compliance, spans, weight, state.room, dt)

    patches: dict[int, Patch] = {}
    after: dict[int, UserState] = {}
    for user, row in zip(observed, _weighted_rows(coupling, weight).tolist(), strict=True):
        number = user.state.touch.user
        own = contact_compliance(compliance, user.state.press, user.loads)
        if number in connected:
            patches[number] = build_patch(touched_body, user, row, own, room, time)
        after[number] = user.state.after(user.free, user.window, own, 1.0 / sum(map(abs, row)))
    world = WorldState(time.number, MappingProxyType(after), response, releases, room, coupling)
    return world, patches


@dataclass(frozen=True, slots=True)
class _Participant:
    touch: Touch
    presence: float


def _participants(
    state: WorldState, connected: Mapping[int, Touch], fade: float
) -> list[_Participant]:
    """Users who take part in this tick, with the share of their force that counts.

    The share of those who are heard rises towards 1 by `fade`; that of all others falls to 0.
    """
    fading = {release.user for release in state.releases}
    participants: list[_Participant] = []
    for number, user in state.users.items():
        touch = connected.get(number) or replace(user.touch, fresh=False)
        rises = touch.fresh and not user.delay.too_long
        presence = user.presence + (fade if rises else -fade)
        if number in fading:
            presence = 0.0  # until the force at its previous contact has faded
        if number in connected or presence > 0.0 or user.force > NEGLIGIBLE:
            participants.append(_Participant(touch, min(1.0, max(0.0, presence))))
    participants += [
        _Participant(touch, min(1.0, fade))
        for number, touch in connected.items()
        if number not in state.users
    ]
    return participants


def _max_contact_move(body: Body, dt: float) -> float:
    """Distance that a hand can move a contact in one tick [m]; beyond it, the contact is new."""
    return max(_MAX_STEP, _MAX_SPEED * dt) + body.contact_radius


def _vertices_ahead(body: Body, users: Sequence[UserState]) -> Ints:
    """Vertices that fingers will press in `PREFETCH_TIME` if they slide on, shape (k,)."""
    vertices = [np.zeros(0, dtype=np.int64)]
    for user in users:
        foot, _, n = user.contact.places
        slide = scale(sub(user.velocity, scale(n, dot(user.velocity, n))), PREFETCH_TIME)
        if _SLOWEST_SLIDE < norm(slide) / body.contact_radius < _FASTEST_SLIDE:
            vertices.append(body.mesh.near(np.array(add(foot, slide)), body.contact_radius))
    return np.concatenate(vertices)


def _weighted_rows(coupling: Floats, weight: Floats) -> Floats:
    """Rows of C as gains see them: each other user by its nearness, the user itself in full."""
    rows = coupling * weight
    rows[np.diag_indices(len(rows))] = np.diag(coupling)
    return rows


def _flat(loads: Sequence[Sequence[Load]]) -> list[Load]:
    return [load for several in loads for load in several]


def _observe(
    touched_body: TouchedBody,
    state: WorldState,
    users: Sequence[UserState],
    own_loads: Sequence[Sequence[Load]],
    response: Response,
    dt: float,
) -> list[UserTick]:
    """Evaluate the surface round each contact, free of that user's own force (science 3.3).

    Args:
        touched_body: The deformable object and its touch mesh.
        state: The world after the last tick.
        users: With the forces of this tick.
        own_loads: Loads of each user, in the order in which the body got them.
        response: Of the body to everybody.
        dt: Simulation period N T [s].
    """
    observed: list[UserTick] = []
    for user, loads, span in zip(users, own_loads, load_spans(own_loads), strict=True):
        previous = state.users.get(user.touch.user)
        window = choose_window(
            touched_body,
            user.touch.geometry,
            user.contact,
            user.velocity,
            # A patch is used until the one that answers the next sample has arrived, and for one
            # more period, in which the client's loop moves over to that one.
            user.delay.value + 2.0 * dt,
            None if previous is None else previous.window,
        )
        forces: Floats = np.array([load.force for load in loads])
        surface = FreeField(response, forces, span)
        free = CachedField(window.vertices, surface.on(window.vertices), surface)
        x_free = place_on(touched_body.body.mesh, user.contact, free)
        depth = dot(user.contact.places[2], sub(x_free, user.touch.probe))
        if depth > 0.0 and len(users) > 1:  # alone, nobody bulges it
            frame, radius = user.contact.frame, touched_body.body.contact_radius
            free = flattened(free, touched_body.body.mesh, frame, x_free, radius, depth)
        near = nearness(user, x_free)
        observed.append(UserTick(user, len(observed), span, window, free, x_free, near))
    return observed
