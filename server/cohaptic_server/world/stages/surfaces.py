"""Stages in which the body answers all forces at once, and each user's free surface is found."""

from __future__ import annotations

import numpy as np

from cohaptic_server.bodies.body import without_own
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.world.contact import MAX_CONTACT_HEIGHT
from cohaptic_server.world.displacement_field import FreeField, KnownFields, flatten_bulges
from cohaptic_server.world.lags.turning import steep_contacts
from cohaptic_server.world.loads import loads_of
from cohaptic_server.world.loops.free_surfaces import put_contacts
from cohaptic_server.world.loops.rows import ContactRows, FieldRows
from cohaptic_server.world.loops.vectors import heights, tangential_parts
from cohaptic_server.world.patch_geometry import NO_WINDOWS, choose_windows
from cohaptic_server.world.stages.stage import Tick
from cohaptic_server.world.state import NEGLIGIBLE
from cohaptic_server.world.users import Observed

# m above the surface; a probe below it counts fully as a neighbour: a hand that trembles near the
# surface does not come and go. Reasoned, not measured.
NEAR_HEIGHT = 0.005
# s; vertices are announced to a body this long before a finger reaches them: a dozen ticks for the
# process that solves for their columns. Reasoned, not measured.
PREFETCH_TIME = 0.2
# Range of slides within `PREFETCH_TIME`, in contact radii, for which vertices are announced. Below
# it, the finger stays nearly where it is; above it, the finger has left before the body could use
# the vertices. Reasoned, not measured.
_SLOWEST_SLIDE, _FASTEST_SLIDE = 0.1, 1.0


def respond(tick: Tick) -> None:
    """Let the body respond to all forces at once."""
    tracked, applied = tick.tracked, tick.applied
    # Steep contacts need the body's response in two more directions, along the surface.
    tick.turns = steep_contacts(tracked.contacts.slopes)
    tick.wide = sorted({*tracked.frictional, *tick.turns})
    fading = [release.faded() for release in tick.releases]
    loads, tick.starts = loads_of(
        tracked.contacts, applied.force, applied.tangential, tick.wide, fading
    )
    if (prefetching := tick.touched_body.prefetching) is not None:
        prefetching.prefetch(_vertices_ahead(tick))
    tick.loads = loads.arrays.forces[: tick.starts[-1]]
    tick.response = tick.touched_body.body.respond(loads, tick.state.response)


def _vertices_ahead(tick: Tick) -> Ints:
    """Return the vertices that sliding fingers will reach within `PREFETCH_TIME`, shape (k,)."""
    body, users = tick.touched_body.body, tick.tracked
    frames, slides = users.contacts.frames, np.empty_like(users.velocity)
    tangential_parts(frames, PREFETCH_TIME * users.velocity, slides)
    lengths = np.sqrt((slides * slides).sum(axis=1)) / body.contact_radius
    vertices = [np.zeros(0, dtype=np.int64)]
    for i in np.flatnonzero((_SLOWEST_SLIDE < lengths) & (lengths < _FASTEST_SLIDE)).tolist():
        vertices.append(body.mesh.near(frames[i, 0] + slides[i], body.contact_radius))
    return np.concatenate(vertices)


def observe(tick: Tick) -> None:
    """Compute each user's free surface round its contact (science 3.3), and who is a neighbour."""
    touched_body, tracked, response = tick.touched_body, tick.tracked, tick.response
    last, starts, forces = tick.state.users.observed, tick.starts, tick.loads
    mesh, contacts, n = touched_body.body.mesh, tracked.contacts, len(tracked.touches)
    tick.delays = [delay.value for delay in tracked.delays]
    # A patch is used until the patch that answers the next sample has arrived, and for one more
    # period, in which the client's loop blends into the new patch.
    horizons = np.array(tick.delays, dtype=np.float64) + 2.0 * tick.time.period
    windows = choose_windows(
        touched_body,
        [touch.who.geometry for touch in tracked.touches],
        contacts,
        tracked.velocity,
        horizons,
        np.full(n, -1) if last is None else tracked.before,
        NO_WINDOWS if last is None else last.windows,
    )
    known = windows.starts[0]
    vertices, x_free = windows.vertices[: known[n]], np.empty((n, 3))
    free = without_own(response, starts, forces, known, vertices)
    search, user, rows = mesh.contacts, 0, FieldRows(known, vertices, free)
    while True:
        user = put_contacts(search.search, search.field, user, ContactRows(*contacts), rows, x_free)
        if user == n:
            break
        a, b = starts[user : user + 2].tolist()
        elsewhere = FreeField(response, forces[a:b], slice(a, b))
        x_free[user] = contacts.contact(user).moved(elsewhere)
        user += 1
    height, shown = np.empty(n), None
    heights(contacts.frames, tracked.probes, x_free, height)
    if n > 1:  # no other user bulges the surface of a user alone
        shown = flatten_bulges(
            mesh, KnownFields(known, vertices, free), contacts.frames, x_free, -height,
            touched_body.body.contact_radius,
        )  # fmt: skip
    tick.observed = Observed(response, starts, forces, windows, free, shown, x_free)
    tick.height, tick.near = height, nearness(height, tick.applied.force)


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
