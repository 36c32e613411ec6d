/** Arrival of patches: the moves of the surface from each to the next, and how long the next may take. */

import { blend, difference, look, shift, type Sight } from "../../control/geometry";
import type { Gains } from "../../control/law";
import { advanced, begun, fits, LONGEST, measured, type Playout } from "../../control/playout";
import type { Vec3 } from "../../model/vec";
import type { Patch } from "../../protocol/patch";
import { settled, switchLaw } from "./law_fade";
import type { LoopSettings, LoopState } from "./state";

// Times the longest gap between patches of late: a silence up to this length is normal for the link.
const PATIENCE = 2;
const LONGEST_PATIENCE = 1; // s; a link that is silent for longer is of no use for touching
const FORGET_GAPS = 30; // s

const MOST_COMING = 32; // patches that wait
const AT_ONCE = 1e-6; // s; rounding of times

/** Receive a patch, which waits for its playing time; a patch older than the newest is ignored. */
export function receive(state: LoopState, patch: Patch, now: number, settings: LoopSettings): LoopState {
  const newest = state.coming.at(-1) ?? state.patch;
  const silent = isSilent(state, now, settings);
  // After a silence the patch may be that of a restarted server, which counts from 1 again.
  if (newest !== null && patch.tick <= newest.tick && !silent) return state;
  const gap = now - state.arrived;
  const patience = gap < Infinity ? nextPatience(state.patience, gap) : state.patience;
  const way = settings.smoothing * settings.simulation_period;
  const follows = newest !== null && patch.tick > newest.tick && patch.t_server > newest.t_server;
  const held = settings.smoothing === 0; // each surface from its coming to the next, as in the paper
  if (held || !follows || !fits(state.playout, now - patch.t_server)) {
    // Also the first patch, or that of another server, or of a server whose clock says nothing.
    const fraction = progress(state, now);
    const playout = begun(now - patch.t_server + way);
    return begin({ ...state, arrived: now, patience, playout }, patch, [], now, settings, fraction);
  }
  const early = settings.simulation_period - way;
  const playout = silent ? state.playout : measured(state.playout, now - newest.t_server - early, now);
  const coming = [...state.coming, patch].slice(-MOST_COMING);
  return play({ ...state, arrived: now, patience, playout, coming }, now, settings);
}

/**
 * Begin the move to the next patch if its time has come.
 *
 * Each patch is shown whole at its own playing time, and the move to it begins at that of the patch before.
 */
export function play(state: LoopState, now: number, settings: LoopSettings): LoopState {
  const { coming, patch } = state;
  const playing = now - state.playout.behind;
  if (coming.length === 0 || patch === null || playing < state.move[1] - AT_ONCE) return state;
  const period = settings.smoothing * settings.simulation_period;
  let first = 0;
  while (playing >= (coming[first + 1]?.t_server ?? Infinity) - period) first++;
  const next = coming[first];
  if (next === undefined || playing < next.t_server - settings.smoothing * (next.t_server - patch.t_server) - AT_ONCE) {
    return state;
  }
  return begin(state, next, coming.slice(first + 1), now, settings, 1);
}

/** The playout after a period of that duration [s]. */
export function played(state: LoopState, now: number, dt: number, settings: LoopSettings): Playout {
  const newest = state.coming.at(-1) ?? state.patch;
  if (newest === null) return state.playout;
  const early = (1 - settings.smoothing) * settings.simulation_period;
  return advanced(state.playout, Math.min(dt, LONGEST), now - newest.t_server - early);
}

/** Begin the move to a patch from what is shown now; `fraction` of the move before is complete. */
function begin(
  state: LoopState,
  patch: Patch,
  rest: readonly Patch[],
  now: number,
  settings: LoopSettings,
  fraction: number,
): LoopState {
  let playing = now - state.playout.behind;
  // The time came between two periods.
  if (playing >= state.move[1] && playing - state.move[1] <= settings.limits.period) playing = state.move[1];
  const least = 0.5 * settings.smoothing * settings.simulation_period;
  const gains: Gains = { k_h: Math.min(patch.k_h, settings.max_stiffness), integral_gain: patch.integral_gain };
  const fade =
    state.fade === null
      ? settled(patch.law, gains)
      : switchLaw(state.fade, patch.law, gains, state.normal_force, state.sight);
  const before = state.patch;
  const atArrival = shown(state, state.probe, fraction);
  const offset = before !== null && atArrival !== null ? difference(atArrival, look(before, state.probe)) : null;
  return {
    ...state, patch, before, offset, k_h_before: fade.now.gains.k_h, fade, coming: rest,
    // Stamps far apart must not make a move that never ends.
    move: [playing, playing + Math.max(least, Math.min(LONGEST + settings.simulation_period, patch.t_server - playing))],
  };
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

/** The surface in use at a probe, in transition from the previous patch to the newest. */
export function shown(state: LoopState, probe: Vec3, fraction: number): Sight | null {
  if (state.patch === null) return null;
  const sight = look(state.patch, probe);
  if (fraction >= 1 || state.before === null) return sight;
  return blend(shift(look(state.before, probe), state.offset), sight, fraction);
}

/** Progress of the move to the newest shown patch, 0 to 1. */
export function progress(state: LoopState, now: number): number {
  const [begins, ends] = state.move;
  const done = ends > begins ? (now - state.playout.behind - begins) / (ends - begins) : 1;
  return done < 1 ? Math.max(0, done) : 1;
}
