"""Stages that make the forces that the body carries from those that users request (science 3.8)."""

from __future__ import annotations

import numpy as np

from cohaptic_server.world.applied_forces import (
    EFFECT_RATE,
    MAX_INDENTATION,
    allowed_fractions,
    anticipate,
    lags_of,
    limit_forces,
    low_pass,
    previous_coupling,
)
from cohaptic_server.world.stages.stage import Tick
from cohaptic_server.world.state import NEGLIGIBLE
from cohaptic_server.world.users import Applied


def limit(tick: Tick) -> None:
    """Cut each force to the limits of its contact and of the body."""
    tick.C = previous_coupling(tick.state, tick.rows, tick.jumped)
    c_ii = tick.C.diagonal()
    largest = MAX_INDENTATION * tick.touched_body.body.mesh.size / np.maximum(c_ii, 1e-12)
    # A force is unbounded if its coupling is not known.
    tick.max_force = np.where(c_ii < np.inf, largest, np.inf)
    requested = tick.force
    tick.force = tick.limited = limit_forces(requested, tick.max_force)
    if tick.tracked.frictional:
        scale = tick.present * (tick.limited / np.maximum(requested, 1e-300))
        tick.along = scale[:, None] * tick.along


def go_ahead(tick: Tick) -> None:
    """Take the forces that hands will have when each has felt the newest forces of the others."""
    plan, state = tick.state.anticipation, tick.state
    if len(plan.users):
        ahead, tick.along = anticipate(plan, state.past, tick.tracked, tick.force, tick.along)
        tick.force = limit_forces(ahead, tick.max_force)
    tick.ahead = tick.force


def lag(tick: Tick) -> None:
    """Let the forces pass the room's lag."""
    lags = lags_of(tick.state, tick.tracked, tick.previous, tick.limited)
    tick.force = tick.lagged = low_pass(tick.previous, tick.force, lags, tick.time.elapsed)
    if tick.tracked.frictional:
        tick.along = low_pass(tick.was, tick.along, lags[:, None], tick.time.elapsed)


def bound_rate(tick: Tick) -> None:
    """Let all others together change the force on one hand no faster than `EFFECT_RATE`."""
    tracked, previous, C = tick.tracked, tick.previous, tick.C.copy()
    change = np.abs(tick.force - previous)
    aside = tick.along - tick.was if tracked.frictional else None
    if aside is not None:
        change += np.sqrt(np.einsum("ij,ij->i", aside, aside))
    # Stiffness K of each hand, at most 1 / C_ii, which is infinite where it is not known.
    device, c_ii = tracked.settings[1], C.diagonal()
    stiffness = np.where(c_ii < np.inf, np.minimum(device, 1.0 / c_ii), device)
    # A hand that feels no force cannot be moved, so no user is slowed down for its sake.
    C[np.maximum(previous, tick.ahead) <= NEGLIGIBLE] = 0.0
    fraction = allowed_fractions(change, stiffness, C, EFFECT_RATE * tick.time.elapsed)
    if aside is not None:
        tick.along = tick.was + fraction[:, None] * aside
    tick.force = previous + fraction * (tick.force - previous)
    present = tick.present * tracked.requested
    tick.applied = Applied(
        tick.presence, tick.force, tick.along, tick.limited < present, fraction < 1.0
    )
    forces = (tracked.asked, present, tick.limited, tick.ahead, tick.lagged, tick.force)
    tick.ledger = np.diff(np.array(forces), axis=0)
