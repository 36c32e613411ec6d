"""The row of a period, for recordings and status: forces, places, and the ledger."""

from __future__ import annotations

from typing import Final

from cohaptic.control.tick_ledger import NOTHING_CUT
from cohaptic.status.reason import (
    CATCHES_UP,
    LAW_CHANGES,
    RELEASED,
    SILENT,
    SLIPS,
    WAITING,
    reason_of,
)
from cohaptic.vec import norm
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.ledger import held_turn, ledger_of
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.safety import EXTERNAL_RATE, Mode, SafetyState
from cohaptic_client.loop.state import LoopState

# Bound once, because the look-up of an enum member takes time in every period (see `safety`).
_FAULT: Final = Mode.FAULT
_ENGAGED: Final = Mode.ENGAGED


def row_of(
    state: LoopState, sample: DeviceSample, period: Period, now: float, late: float
) -> tuple[float, ...]:
    """Return the values of `cohaptic.status.row.Row`, in its order.

    A tuple, because the interpreted constructor takes longer than a period.

    Args:
        state: State after the period.
        sample: What the device said.
        period: The period.
        now: Time of the period [s].
        late: Delay with which it began [s].
    """
    patch, local = state.patch, period.local
    ledger = ledger_of(period, period.settings.limits.max_force)
    tick = NOTHING_CUT if patch is None else patch.ledger
    added = [*period.added, 0.0, 0.0, 0.0, 0.0]
    x, y, z = sample.position
    fx, fy, fz = period.force
    return (
        now, x, y, z, fx, fy, fz,
        local.normal_force, local.felt_from_others, period.u_others, local.indentation,
        state.k_h, period.damping_force, patch.k_o if patch is not None else 0.0,
        sample.level, state.safety.scale, late, patch.tick if patch is not None else 0,
        now - state.arrived if patch is not None else 0.0,
        patch.room.lag if patch is not None else 0.0,
        state.safety.scale * norm(state.friction.force), fault_level(state.safety),
        ledger.surface, ledger.models, ledger.gain, ledger.depth, ledger.law, ledger.friction,
        ledger.limit, ledger.fade, ledger.rate, held_turn(period), period.spent_gain,
        period.spent_fades, period.spent_turn, period.spent_models, period.spent_depth,
        EXTERNAL_RATE * period.counted, norm(period.on_body),
        norm(patch.own_force) if patch is not None else 0.0,
        tick.by_presence, tick.by_limit, tick.by_anticipation, tick.by_lag, tick.by_rate,
        tick.gain_cut, reason_in(state, period),
        added[0], added[1], added[2], added[3],
    )  # fmt: skip


def fault_level(safety: SafetyState) -> float:
    """Return a row's fault level: 0 for no fault, 1 for one, 2 for one to be acknowledged."""
    if safety.mode is _FAULT:
        return 2.0
    return 1.0 if safety.fault else 0.0


def reason_in(state: LoopState, period: Period) -> float:
    """Return a row's `reason`, as in `cohaptic.status.reason`.

    Args:
        state: State after the period.
        period: The period.
    """
    safety, fade, flags = state.safety, state.fade, 0
    if period.silent:
        flags += SILENT
    if safety.mode is not _ENGAGED:
        flags += WAITING
    if safety.left > 0.0 or safety.mode is _FAULT:
        flags += RELEASED
    if state.friction.slips:
        flags += SLIPS
    if safety.catch_up > 0.0:
        flags += CATCHES_UP
    if fade is not None and fade.before is not None:
        flags += LAW_CHANGES
    return reason_of(flags, safety.cause)
