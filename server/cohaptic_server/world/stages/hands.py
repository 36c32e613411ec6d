"""Stages at the beginning of a tick: who takes part, where each touches, and who jumped away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cohaptic_server.world.applied_forces import (
    RELEASE_TIME,
    previous_tangential,
    rows_before,
    update_releases,
)
from cohaptic_server.world.contact_tracking import track_contacts
from cohaptic_server.world.stages.stage import Tick
from cohaptic_server.world.state import NEGLIGIBLE, Touch


def take_part(tick: Tick) -> None:
    """Find the users who take part in this tick, and how much of the force of each counts.

    The presence of a user is the share of its force that counts. It rises towards 1 if samples
    arrive and the user's loop is not too slow, and falls towards 0 otherwise.
    """
    state, connected, fade = tick.state, tick.connected, tick.time.elapsed / RELEASE_TIME
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
    tick.touches, tick.before = touches, rows
    tick.presence = np.minimum(1.0, np.maximum(0.0, presence))


def track(tick: Tick) -> None:
    """Find each contact, and the force that its user requests there."""
    tick.tracked = track_contacts(
        tick.touched_body.body, tick.state, tick.touches, tick.before, tick.presence, tick.time
    )


def release(tick: Tick) -> None:
    """Leave the force of a contact that jumped where it was, to fade there.

    Its user does not press at the new contact before that force has faded.
    """
    tracked, last = tick.tracked, tick.state.users.applied
    tick.rows, tick.jumped = rows_before(tick.state, tracked, tick.max_move)
    fade = tick.time.elapsed / RELEASE_TIME
    tick.releases = update_releases(tick.state, tracked, tick.rows, fade)
    n = len(tracked.touches)
    tick.previous, tick.present = np.zeros(n), np.ones(n)
    here = tracked.before >= 0
    tick.previous[here] = last.force[tracked.before[here]]
    tick.force = tracked.requested
    if tick.releases:
        released = {release.user for release in tick.releases}
        tick.present[[touch.user in released for touch in tracked.touches]] = 0.0
        tick.presence = tick.present * tick.presence
        tick.force = tick.present * tick.force
        tick.previous = tick.present * tick.previous
    tick.along = tick.was = tracked.tangential
    if tracked.frictional:
        tick.was = previous_tangential(last, tracked, tick.present)
