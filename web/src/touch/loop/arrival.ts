/** Arrival of a patch: the transition of the surface to it, and how long the next may take. */

import { blend, difference, look, shift, type Sight } from "../../control/geometry";
import type { Gains } from "../../control/law";
import type { Vec3 } from "../../model/vec";
import type { Patch } from "../../protocol/patch";
import { settled, switchLaw } from "./law_fade";
import type { LoopSettings, LoopState } from "./state";

// Times the longest gap between patches of late: a silence up to this length is normal for the link.
const PATIENCE = 2;
const LONGEST_PATIENCE = 1; // s; a link that is silent for longer is of no use for touching
const FORGET_GAPS = 30; // s

/**
 * Receive a patch; a patch older than the newest is ignored.
 *
 * Surface and gain move to the new patch over one simulation period, from the surface in use.
 */
export function receive(state: LoopState, patch: Patch, now: number, settings: LoopSettings): LoopState {
  // After a silence the patch may be that of a restarted server, which counts from 1 again.
  const stale = state.patch !== null && patch.tick <= state.patch.tick;
  if (stale && !isSilent(state, now, settings)) return state;
  const gains: Gains = { k_h: Math.min(patch.k_h, settings.max_stiffness), integral_gain: patch.integral_gain };
  const gap = now - state.arrived;
  const patience = gap < Infinity ? nextPatience(state.patience, gap) : state.patience;
  const fade =
    state.fade === null
      ? settled(patch.law, gains)
      : switchLaw(state.fade, patch.law, gains, state.normal_force, state.sight);
  const before = state.patch;
  const atArrival = shown(state, state.probe, now, settings);
  const offset = before !== null && atArrival !== null ? difference(atArrival, look(before, state.probe)) : null;
  return { ...state, patch, arrived: now, before, offset, k_h_before: fade.now.gains.k_h, fade, patience };
}

/** Longest normal silence of the server after one more patch, which came `gap` after the one before [s]. */
export function nextPatience(patience: number, gap: number): number {
  const kept = patience * Math.exp(-gap / FORGET_GAPS);
  // A longer gap is an outage and says nothing about the normal gaps of the link.
  return gap > LONGEST_PATIENCE ? kept : Math.min(LONGEST_PATIENCE, Math.max(PATIENCE * gap, kept));
}

/**
 * Whether the newest patch is so old that the server counts as silent.
 *
 * The patience grows with the link's jitter; otherwise the force would fade again and again, each time a pulse for the others.
 */
export function isSilent(state: LoopState, now: number, settings: LoopSettings): boolean {
  return now - state.arrived > Math.max(settings.limits.silent_after, state.patience);
}

/** The surface in use at a probe at `now`, in transition from the previous patch to the newest. */
export function shown(state: LoopState, probe: Vec3, now: number, settings: LoopSettings): Sight | null {
  if (state.patch === null) return null;
  const sight = look(state.patch, probe);
  const share = progress(state, now, settings);
  if (share >= 1 || state.before === null) return sight;
  return blend(shift(look(state.before, probe), state.offset), sight, share);
}

/** Progress of the transition to the newest patch, 0 to 1. */
export function progress(state: LoopState, now: number, settings: LoopSettings): number {
  const way = settings.smoothing * settings.simulation_period;
  return way > 0 ? Math.min(1, (now - state.arrived) / way) : 1;
}
