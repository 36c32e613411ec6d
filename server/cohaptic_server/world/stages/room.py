"""Stages that find how hands move each other, and with it the room's lag for the next tick."""

from __future__ import annotations

import math
from itertools import pairwise

from cohaptic.control.delay import TOO_LONG
from cohaptic_server.world.applied_forces import remember
from cohaptic_server.world.lags.felt_swing import show_swing
from cohaptic_server.world.lags.planning import (
    CALM_TIME,
    find_anticipation,
    find_lag,
    known_coupling,
)
from cohaptic_server.world.lags.room_loop import room_loop
from cohaptic_server.world.lags.turning import find_turning_lag, turned_loop
from cohaptic_server.world.loads import bounded, compliance_between, without_tangents
from cohaptic_server.world.stages.stage import Tick
from cohaptic_server.world.state import NEGLIGIBLE
from cohaptic_server.world.users import Hand


def couple(tick: Tick) -> None:
    """Find how far a force at each contact moves the others, and the loop that hands close so."""
    tracked, period = tick.tracked, tick.time.period
    steep = [i for i in tick.turns if i not in tracked.frictional]
    wide_spans = [slice(a, b) for a, b in pairwise(tick.starts.tolist())]
    compliance, tick.spans = without_tangents(tick.response.compliance, wide_spans, steep)
    tick.compliance = bounded(compliance, tick.spans)
    tick.coupling = compliance_between(tick.compliance, tick.spans)
    tick.hands = list(map(Hand, tracked.touches, tracked.delays))
    tick.pressing = tick.applied.force > NEGLIGIBLE
    tick.loop = room_loop(tick.hands, tick.compliance, tick.spans, tick.pressing, period)
    tick.turned = None
    if tick.turns:
        tick.turned = turned_loop(
            tick.hands, tick.response.compliance, wide_spans, tracked.contacts,
            tick.touched_body.body.mesh, tick.pressing,
        )  # fmt: skip


def plan(tick: Tick) -> None:
    """Choose the part of the coupling to anticipate, and the lag of the rest, for the next tick."""
    state, time, tracked = tick.state, tick.time, tick.tracked
    S = known_coupling(tick.loop, tick.turned)
    # A hand with a law of the paper may come and go in every tick, as contacts at a limit may.
    tick.unknown_at = time.now if S is None or tick.loop.paper_laws else state.unknown_at
    if time.now - tick.unknown_at < CALM_TIME:
        S = None
    tick.plan = find_anticipation(tick.loop, tracked.contacts.normals, S, tick.turned, time.period)
    ticks = math.ceil(TOO_LONG / time.period) + 1
    tick.past = remember(state.past, time, tracked, tick.applied, ticks)
    tick.room, tick.cause = find_lag(tick.loop, tick.plan, state.room, state.cause, time.elapsed)
    # Where forces are anticipated, contacts turn at once, as the anticipation assumes.
    turned = None if tick.plan.gains else tick.turned
    tick.turning = find_turning_lag(turned, tick.loop.longest_delay, tick.room.lag)


def show(tick: Tick) -> None:
    """Choose the share of a swing that hands feel in the next tick."""
    if (body := tick.touched_body.swings) is not None:
        tick.response = show_swing(
            body, tick.response, tick.hands, tick.near.tolist(), tick.plan.gains, tick.room.lag,
            tick.compliance, tick.spans, tick.starts.tolist(), tick.time.elapsed,
        )  # fmt: skip
