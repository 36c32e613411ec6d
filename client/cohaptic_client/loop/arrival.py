"""Takes new patches into the loop's state, and moves the shown surface from each to the next."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from cohaptic.control.geometry import Sight, blend, difference, shift
from cohaptic.control.mesh_surface import Surface
from cohaptic.control.playout import LONGEST, Playout
from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.patch import Patch
from cohaptic.vec import Vec3
from cohaptic_client.loop.gains import gains_as_sent
from cohaptic_client.loop.law_fade import LawFade, Running, switch
from cohaptic_client.loop.replica import Replica, follow
from cohaptic_client.loop.state import Coming, LoopSettings, LoopState

# Multiple of the longest recent gap between patches; a shorter silence is the link's jitter, and a
# fade for it is a pulse for all others (test_arrival.py). The 2 is reasoned, not measured.
PATIENCE: Final = 2.0
# s; a link with longer silences is too poor for touch. Reasoned, not measured.
LONGEST_PATIENCE: Final = 1.0
# s; time constant with which a long gap is forgotten: a link that stalls a few times in a minute is
# still waited for. Reasoned, not measured.
FORGET_GAPS: Final = 30.0
MAX_COMING: Final = 32  # patches that wait: `LONGEST` of them at 120 Hz; then the oldest go
# Simulation periods from patch to patch from which on what others want moves along a parabola.
# Lines between punctual ticks are what the theorem of science 3.15 reckons with, and as smooth. A
# quarter is more than a timer's jitter and less than a missed tick. Reasoned, not measured.
_LATE: Final = 1.25
_AT_ONCE: Final = 1e-6  # s; rounding of times


def receive(
    state: LoopState,
    patch: Patch,
    now: float,
    settings: LoopSettings,
    surface: Surface | None = None,
) -> LoopState:
    """Return the state with a new patch; ignore a patch that is invalid or older than the newest.

    The network process has already checked the patch. With the check here, invalid patches from a
    broken network process count as silence. A NaN would stay in the loop's memory for ever.

    Args:
        state: State after the last period.
        patch: Patch that has arrived.
        now: Time of this period [s].
        surface: Surface of the patch if it has been made already; None to make it now.
    """
    if not _is_news(state, patch, now, settings):
        return state
    newest = newest_patch(state)
    gap = now - state.arrived
    patience = next_patience(state.patience, gap) if gap < math.inf else state.patience
    if surface is None:
        surface = settings.surface(patch)
    one, way = Coming(patch, surface), settings.smoothing * settings.simulation_period
    held = settings.smoothing == 0.0  # each surface from its coming to the next, as in the paper
    if held or newest is None or not _follows(patch, newest, state.playout, now):
        # Also the first patch, or that of another server, or of one whose clock says nothing.
        fraction, playout = progress(state, now), Playout.begun(now - patch.t_server + way)
        state = replace(state, arrived=now, patience=patience, playout=playout)
        return _begin(state, one, (), now, settings, fraction)
    playout = state.playout
    if not is_silent(state, now, settings):
        early = settings.simulation_period - way
        playout = playout.measured(now - newest.t_server - early, now)
    coming = (*state.coming, one)[-MAX_COMING:]
    state = replace(state, arrived=now, patience=patience, playout=playout, coming=coming)
    return play(state, now, settings)


def _follows(patch: Patch, newest: Patch, playout: Playout, now: float) -> bool:
    """Return whether a patch has come from the clock of the newest before, and after it."""
    later = patch.tick > newest.tick and patch.t_server > newest.t_server
    return later and playout.fits(now - patch.t_server)


def newest_patch(state: LoopState) -> Patch | None:
    """Return the newest patch that has come, which may wait; None before the first."""
    return state.coming[-1].patch if state.coming else state.patch


def play(state: LoopState, now: float, settings: LoopSettings) -> LoopState:
    """Begin the move to the next patch if its time has come.

    Each patch is shown whole at its own playing time, and the move to it begins at that of the
    patch before. So what is shown is late by the same time however late each patch came, and the
    move, a straight line between two patches, is also a filter (half of it would make forces 4 ms
    younger at 60 Hz, but coupled hands would settle several times more slowly). A patch that came
    too late for that is caught up with; others are left out if several are late.

    Args:
        state: State after the last period.
        now: Time of this period [s].
    """
    coming, period = state.coming, settings.smoothing * settings.simulation_period
    playing = now - state.playout.behind
    if not coming or playing < state.move_ends - _AT_ONCE:
        return state
    first = 0
    while first + 1 < len(coming) and playing >= coming[first + 1].patch.t_server - period:
        first += 1
    assert state.patch is not None
    stamp = coming[first].patch.t_server
    begins = stamp - settings.smoothing * (stamp - state.patch.t_server)
    if playing < begins - _AT_ONCE:
        return state
    return _begin(state, coming[first], coming[first + 1 :], now, settings, 1.0)


def played(state: LoopState, now: float, dt: float, settings: LoopSettings) -> Playout:
    """Return the playout after a period of that duration [s]."""
    newest = newest_patch(state)
    if newest is None:
        return state.playout
    playout, early = state.playout, (1.0 - settings.smoothing) * settings.simulation_period
    age = now - newest.t_server - early
    # Without calls, because this runs in every period and mostly finds nothing to do.
    if playout.behind == playout.wanted and age <= playout.behind:
        return playout
    return playout.advanced(min(dt, LONGEST), age)


def _begin(
    state: LoopState,
    one: Coming,
    rest: tuple[Coming, ...],
    now: float,
    settings: LoopSettings,
    fraction: float,
) -> LoopState:
    """Return the state at the beginning of the move to a patch, from what is shown now.

    Args:
        state: State after the last period.
        one: The patch.
        rest: Patches that come after it.
        now: Time of this period [s].
        fraction: Completed fraction of the move before.
    """
    patch = one.patch
    playing = now - state.playout.behind
    if 0.0 <= playing - state.move_ends <= settings.limits.period:
        playing = state.move_ends  # the time came between two periods
    least = 0.5 * settings.smoothing * settings.simulation_period
    # Stamps far apart must not make a move that never ends.
    limit = LONGEST + settings.simulation_period
    ends = playing + max(least, min(limit, patch.t_server - playing))
    gains = gains_as_sent(patch, settings)
    if state.fade is None:
        fade = LawFade(Running(patch.law, gains))
    else:
        fade = switch(state.fade, patch.law, gains, force=state.normal_force, sight=state.sight)
    before, offset = state.surface, None
    at_arrival = shown(state, state.probe, fraction)
    if before is not None and at_arrival is not None:
        offset = difference(at_arrival, before.look(state.probe))
    return LoopState(
        patch=patch,
        arrived=state.arrived,
        before=before,
        offset=offset,
        surface=one.surface,
        k_h_before=fade.now.gains.k_h,
        fade=fade,
        normal_force=state.normal_force,
        sight=state.sight,
        depth=state.depth,
        probe=state.probe,
        normal=state.normal,
        passivity=state.passivity,
        friction=state.friction,
        compliance=state.compliance,
        safety=state.safety,
        patience=state.patience,
        replica=_models(state, patch, fraction, ends - playing, settings),
        trust=state.trust,
        playout=state.playout,
        coming=rest,
        move_begins=playing,
        move_ends=ends,
        memories=state.memories,
    )


def _models(
    state: LoopState, patch: Patch, fraction: float, way: float, settings: LoopSettings
) -> Replica | None:
    """Return the models with the partners of a new patch; None if it has none.

    A server that has been restarted counts its users from 1 again, like its ticks.

    Args:
        state: State after the last period.
        patch: The new patch.
        fraction: Completed fraction of the move before.
        way: Duration of the move to the new patch [s].
    """
    if patch.partners is None:
        return None
    again = state.patch is not None and patch.tick <= state.patch.tick
    late = way > _LATE * settings.simulation_period
    before = (state.move_ends - state.move_begins) / way if late else 0.0
    return follow(None if again else state.replica, patch.partners, fraction, before)


def _is_news(state: LoopState, patch: Patch, now: float, settings: LoopSettings) -> bool:
    """Return whether the loop should use this patch.

    The patch must be valid, and newer than the newest patch unless the server was silent.
    """
    try:
        patch.check(remote=True)
    except RemoteProtocolError:
        return False
    # After a silence the patch may come from a restarted server, which counts from 1.
    newest = newest_patch(state)
    return newest is None or patch.tick > newest.tick or is_silent(state, now, settings)


def progress(state: LoopState, now: float) -> float:
    """Return how much of the move to the newest shown patch is complete at `now` [s], 0 to 1."""
    way = state.move_ends - state.move_begins
    done = (now - state.playout.behind - state.move_begins) / way if way > 0.0 else 1.0
    return max(0.0, done) if done < 1.0 else 1.0


def shown(state: LoopState, probe: Vec3, fraction: float) -> Sight | None:
    """Sample the shown surface at a probe; return None before the first patch.

    During the move to the newest patch the sample lies between the samples of both patches. With
    friction, too, the surface is evaluated at the tip, and not at the tip less its displacement
    over the material: there a curved patch would turn with that displacement, and the finger's own
    force would carry a sliding finger away (science 3.10).

    Args:
        state: State after the arrival of the newest patch.
        probe: Position of the tip [m].
        fraction: Completed fraction of the move to the newest, from `progress`.
    """
    if state.surface is None:
        return None
    sight = state.surface.look(probe)
    if fraction >= 1.0 or state.before is None:
        return sight
    return blend(shift(state.before.look(probe), state.offset), sight, fraction)


def is_silent(state: LoopState, now: float, settings: LoopSettings) -> bool:
    """Return whether the newest patch is so old that the server counts as silent.

    The limit grows with the gaps between patches. On a link with jitter a fixed limit would fade
    the force again and again, and every fade is a pulse for the other users. A longer limit is
    harmless, because the local surface is passive by itself.
    """
    return now - state.arrived > max(settings.limits.silent_after, state.patience)


def next_patience(patience: float, gap: float) -> float:
    """Return the time for which the server may be silent, updated for one more patch [s].

    Args:
        patience: That time before the patch [s].
        gap: Time since the previous patch [s].
    """
    kept = patience * math.exp(-gap / FORGET_GAPS)
    if gap > LONGEST_PATIENCE:
        return kept  # an outage says nothing about the jitter of the link
    return min(LONGEST_PATIENCE, max(PATIENCE * gap, kept))
