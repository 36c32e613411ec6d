"""Takes a new patch into the loop's state, and moves the shown surface to the new patch."""

from __future__ import annotations

import math
from typing import Final

from cohaptic.control.geometry import Sight, blend, difference, shift
from cohaptic.control.mesh_surface import Surface
from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.patch import Patch
from cohaptic.vec import Vec3
from cohaptic_client.loop.contact import gains_as_sent
from cohaptic_client.loop.law_fade import LawFade, Running, switch
from cohaptic_client.loop.replica import Replica, follow
from cohaptic_client.loop.state import LoopSettings, LoopState

# Multiple of the longest recent gap between patches; a shorter silence is the link's jitter.
PATIENCE: Final = 2.0
LONGEST_PATIENCE: Final = 1.0  # s; a link with longer silences is too poor for touch
FORGET_GAPS: Final = 30.0  # s; time constant with which a long gap is forgotten


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

    The surface and the gain move to the new patch over one simulation period, from the surface that
    is shown now. (Half a period would make forces 4 ms younger at 60 Hz, but coupled hands would
    settle several times more slowly: the transition is also a filter. Stability goes before
    transparency.)

    Args:
        state: State after the last period.
        patch: Patch that has arrived.
        now: Time of this period [s].
        surface: Surface of the patch if it has been made already; None to make it now.
    """
    if not _is_news(state, patch, now, settings):
        return state
    if surface is None:
        surface = settings.surface(patch)
    gains = gains_as_sent(patch, settings)
    gap = now - state.arrived
    patience = next_patience(state.patience, gap) if gap < math.inf else state.patience
    if state.fade is None:
        fade = LawFade(Running(patch.law, gains))
    else:
        fade = switch(state.fade, patch.law, gains, force=state.normal_force, sight=state.sight)
    before, offset = state.surface, None
    share = progress(state, now, settings)
    at_arrival = shown(state, state.probe, share)
    if before is not None and at_arrival is not None:
        offset = difference(at_arrival, before.look(state.probe))
    return LoopState(
        patch=patch,
        arrived=now,
        before=before,
        offset=offset,
        surface=surface,
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
        patience=patience,
        replica=_models(state, patch, share),
        trust=state.trust,
    )


def _models(state: LoopState, patch: Patch, share: float) -> Replica | None:
    """Return the models with the partners of a new patch; None if it has none.

    A server that has been restarted counts its users from 1 again, like its ticks.
    """
    if patch.partners is None:
        return None
    again = state.patch is not None and patch.tick <= state.patch.tick
    return follow(None if again else state.replica, patch.partners, share)


def _is_news(state: LoopState, patch: Patch, now: float, settings: LoopSettings) -> bool:
    """Return whether the loop should use this patch.

    The patch must be valid, and newer than the newest patch unless the server was silent.
    """
    try:
        patch.check(remote=True)
    except RemoteProtocolError:
        return False
    # After a silence the patch may come from a restarted server, which counts from 1.
    newest = state.patch
    return newest is None or patch.tick > newest.tick or is_silent(state, now, settings)


def progress(state: LoopState, now: float, settings: LoopSettings) -> float:
    """Return how much of the move to the newest patch is complete at time `now` [s], 0 to 1."""
    way = settings.smoothing * settings.simulation_period
    return min(1.0, (now - state.arrived) / way) if way > 0.0 else 1.0


def shown(state: LoopState, probe: Vec3, share: float) -> Sight | None:
    """Sample the shown surface at a probe; return None before the first patch.

    During the move to the newest patch the sample lies between the samples of both patches. With
    friction, too, the surface is evaluated at the tip, and not at the tip less its displacement
    over the material: there a curved patch would turn with that displacement, and the finger's own
    force would carry a sliding finger away (science 3.10).

    Args:
        state: State after the arrival of the newest patch.
        probe: Position of the tip [m].
        share: Completed fraction of the move, from `progress`.
    """
    if state.surface is None:
        return None
    sight = state.surface.look(probe)
    if share >= 1.0 or state.before is None:
        return sight
    return blend(shift(state.before.look(probe), state.offset), sight, share)


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
