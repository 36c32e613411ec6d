"""The world advances by one simulation period: forces in, patches out. No I/O.

Order within a tick: find each contact on the surface free of its own force (`placing.py`), let in
what the body may get of everybody's force (`letting_in.py`), let the body respond to all of it at
once, look at the free surface round each contact (`field.py`), then cut one patch per user
(`cutting.py`). A user who is gone, or whose samples stopped, lets go over `RELEASE_TIME`: nobody
else's force jumps because a cable was pulled.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from cohaptic.protocol.patch import Patch
from cohaptic_server.bodies.body import Body, Prefetching
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Ints
from cohaptic_server.world.applied_forces import let_in, release
from cohaptic_server.world.contact_tracking import place
from cohaptic_server.world.displacement_field import FreeOf, Window
from cohaptic_server.world.loads import compliance_between, contact_compliance, floored, spans
from cohaptic_server.world.patch import cut, nearness
from cohaptic_server.world.patch_geometry import Sight, look, with_shape
from cohaptic_server.world.room_lag import find_lag
from cohaptic_server.world.state import NEGLIGIBLE, Touch, UserState, WorldState

RELEASE_TIME = 0.3  # s; a hand that lets go on purpose takes about as long
AHEAD = 0.2  # s that a body is told of what will be touched before it is
# Contact radii on the way of that time: with less a finger presses where it is, with more it is
# gone before anybody could have used the news.
_CREEPS, _RUNS = 0.1, 1.0


def advance(
    touched_body: TouchedBody,
    state: WorldState,
    touches: Iterable[Touch],
    *,
    now: float,
    dt: float,
) -> tuple[WorldState, dict[int, Patch]]:
    """One simulation tick.

    Args:
        touched_body: The deformable object and its touch mesh.
        state: The world after the last tick.
        touches: Of every user who is here.
        now: Time of this tick on the server's clock [s].
        dt: Simulation period N T [s].

    Returns:
        The world after this tick, and a patch for each of `touches`.
    """
    body = touched_body.body
    here = {touch.user: touch for touch in touches}
    step = dt / RELEASE_TIME
    present = _carry_over(state, here, step)
    found = [place(body, state, p.touch, p.presence, now=now, dt=dt) for p in present]
    releases = release(state, found, step, jump=_jump(body, dt))
    placed = let_in(body, state, found, {r.user for r in releases}, dt, jump=_jump(body, dt))
    presses = [user.press for user in placed]
    where = spans(presses)
    loads = [load for press in presses for load in press.loads()]
    loads += [load for left in releases for load in left.faded().loads()]
    if isinstance(body, Prefetching):
        body.prefetch(_ahead(body, placed))
    response = body.respond(loads, state.response)
    # In use until the patch after the next sample is here, and while the loop moves on.
    horizons = [user.delay.value + 2.0 * dt for user in placed]
    windows: list[Window] = []
    sights: list[Sight] = []
    for user, press, span, horizon in zip(placed, presses, where, horizons, strict=True):
        forces = np.array([load.force for load in press.loads()])
        before = state.users.get(user.touch.user)
        sight = look(
            touched_body,
            user.touch.geometry,
            user.contact,
            user.velocity,
            horizon,
            None if before is None else before.sight,
        )
        sights.append(sight)
        beyond = FreeOf(response, forces, span)
        windows.append(Window(sight.vertices, beyond.on(sight.vertices), beyond))
    free = [user.contact.moved(window) for user, window in zip(placed, windows, strict=True)]
    near = np.array([nearness(u, point) for u, point in zip(placed, free, strict=True)])
    compliance = floored(response.compliance, where)
    coupling = compliance_between(compliance, where)
    rows = coupling * near
    rows[np.diag_indices(len(rows))] = np.diag(coupling)  # itself in full
    room = find_lag(placed, compliance, where, near, state.room, dt)
    tick = state.tick + 1
    patches: dict[int, Patch] = {}
    after: dict[int, UserState] = {}
    for i, user in enumerate(placed):
        number, row = user.touch.user, rows[i]
        whole = contact_compliance(compliance, presses[i], where[i])
        if number in here:
            patch = cut(user, free[i], row.tolist(), i, whole, room, tick=tick, now=now, dt=dt)
            patches[number] = with_shape(patch, touched_body, sights[i], windows[i])
        after[number] = replace(
            user,
            free=windows[i],
            sight=sights[i],
            compliance=whole,
            k_o_coupled=1.0 / float(np.abs(row).sum()),
        )
    users = MappingProxyType(after)
    return WorldState(tick, users, response, releases, room, coupling), patches


def _jump(body: Body, dt: float) -> float:
    """Way of a contact in one tick that no hand makes [m]: it is elsewhere, not further on."""
    return max(_LEAP, _FASTEST * dt) + body.contact_radius


_LEAP, _FASTEST = 0.03, 1.5  # m; m/s, the speed at which a client's safety layer lets go


def _ahead(body: Body, users: Sequence[UserState]) -> Ints:
    """Vertices that fingers will press after `AHEAD` if they slide on, shape (k,)."""
    found = [np.zeros(0, dtype=np.int64)]
    for user in users:
        n = user.contact.normal
        along = AHEAD * (user.velocity - (user.velocity @ n) * n)
        way = math.sqrt(along @ along) / body.contact_radius
        if _CREEPS < way < _RUNS:
            found.append(body.mesh.near(user.contact.foot + along, body.contact_radius))
    return np.concatenate(found)


@dataclass(frozen=True, slots=True)
class _Present:
    touch: Touch
    presence: float


def _carry_over(state: WorldState, here: Mapping[int, Touch], step: float) -> list[_Present]:
    """Who takes part in this tick: those heard, rising to full presence; the others, falling."""
    fading = {left.user for left in state.releases}
    present: list[_Present] = []
    for number, user in state.users.items():
        touch = here.get(number, replace(user.touch, fresh=False))
        rises = touch.fresh and not user.delay.too_long
        presence = user.presence + (step if rises else -step)
        if number in fading:
            presence = 0.0  # until it is gone where it was
        if number in here or presence > 0.0 or user.force > NEGLIGIBLE:
            present.append(_Present(touch, min(1.0, max(0.0, presence))))
    present += [
        _Present(touch, min(1.0, step)) for n, touch in here.items() if n not in state.users
    ]
    return present
