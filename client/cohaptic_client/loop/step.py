"""One period of the haptic loop as a pure function: an hour of haptics is a `for` loop in a test.

A period runs the rules of `chain.py` in their order. A law that fails, a tip out of reach and a
position that is not a number are faults: the force is released, and the loop runs on.
"""

from __future__ import annotations

from cohaptic.status.reason import LAW_FAILED, RULE_FAILED
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.arrival import is_silent, played
from cohaptic_client.loop.chain import CHAIN, FAULT
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.replica import left_alone
from cohaptic_client.loop.rule import Rule, RuleError
from cohaptic_client.loop.safety import Trouble
from cohaptic_client.loop.state import LoopSettings, LoopState


def step(
    state: LoopState,
    sample: DeviceSample,
    now: float,
    settings: LoopSettings,
    chain: tuple[Rule, ...] = CHAIN,
) -> tuple[LoopState, Period]:
    """Compute one haptic period, from a device's sample to the force that the device gets.

    Args:
        state: State after the last period.
        now: Time of this period [s].
        chain: Rules, in their order.

    Returns:
        State after this period, and the period with its results.
    """
    period = Period(state, sample, now, settings)
    try:
        for rule in chain:
            rule.apply(period)
    except (ArithmeticError, ValueError) as error:
        trouble = period.trouble
        if not trouble.cause:
            trouble = Trouble(LAW_FAILED, f"the law failed: {error}")
            if isinstance(error, RuleError):
                trouble = Trouble(RULE_FAILED, str(error))
        return _without_surface(period, state, trouble)
    return _memory(period), period


def _memory(period: Period) -> LoopState:
    """Return the memory after a period."""
    state, now = period.state, period.now
    return LoopState(
        patch=state.patch,
        arrived=state.arrived if state.arrived < now else now,
        before=state.before,
        offset=state.offset,
        surface=state.surface,
        k_h_before=state.k_h_before,
        fade=period.fade,
        normal_force=period.local.normal_force,
        sight=period.sight,
        depth=period.depth,
        probe=period.sample.position,
        normal=period.normal,
        passivity=period.passivity,
        friction=period.friction,
        compliance=period.compliance,
        safety=period.safety,
        patience=state.patience,
        replica=period.replica,
        trust=period.trust,
        playout=played(state, now, period.dt, period.settings),
        coming=state.coming,
        move_begins=state.move_begins,
        move_ends=state.move_ends,
        memories=period.memories,
    )


def _without_surface(
    period: Period, state: LoopState, trouble: Trouble
) -> tuple[LoopState, Period]:
    """Compute a period after a fault: release the force, and use no surface until the next patch.

    Args:
        period: Period in which a rule failed.
        state: State after the last period.
        trouble: Reason why the force is released.

    Returns:
        State after this period, and the period with its results.
    """
    sample, now, limits = period.sample, period.now, period.settings.limits
    empty = Period(state, sample, now, period.settings)
    empty.trouble = trouble
    FAULT.apply(empty)
    replica = state.replica
    after = LoopState(
        patch=state.patch,
        arrived=min(state.arrived, now),  # a clock that goes back makes no patch younger
        probe=sample.position,
        safety=empty.safety,
        patience=state.patience,
        replica=None if replica is None else left_alone(replica, limits.period),
        trust=state.trust,
        playout=state.playout,
        coming=state.coming,
        move_begins=state.move_begins,
        move_ends=state.move_ends,
    )
    empty.silent = is_silent(state, now, period.settings)
    empty.deflection = None if replica is None else replica.deflections[0].y
    return after, empty
