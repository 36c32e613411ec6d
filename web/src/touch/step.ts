/**
 * One period of the haptic loop as a pure function, and the arrival of a patch as another.
 *
 * `client/cohaptic_client/step.py` in TypeScript, for planes and spheres without friction.
 */

import { blend, difference, look, shift, type Sight } from "../control/geometry";
import { DEFAULT_LAW_SETTINGS, type Gains, type LawSettings, type LocalForce, NO_FORCE, pressedDepth } from "../control/law";
import type { Patch } from "../protocol/patch";
import type { LawName, Vec3 } from "../types";
import { dot, norm, scale, sub, ZERO } from "../vec";
import { type LawFade, run, settled, switchLaw, withGains } from "./law_fade";
import { dissipate, NOTHING_OWED, observe, type Passivity } from "./passivity";
import { DEFAULT_LIMITS, guard, NOT_ENGAGED, type SafetyLimits, type SafetyState } from "./safety";

// A gain moves by at most 1 % per millisecond: a new neighbour never jolts the hand.
const GAIN_RATE = 10; // 1/s
const MOST_CHANGE = 2; // of a compliance within one patch; more is a mistake of the patch

/** What one client's loop is told. */
export interface LoopSettings {
  /** Time between patches, N T [s]. */
  readonly simulation_period: number;
  readonly limits: SafetyLimits;
  readonly law: LawSettings;
  /** Share of a simulation period over which the loop moves to a new patch; 0 holds it as the paper does. */
  readonly smoothing: number;
  /** Of the passivity layer; 0 switches it off [N s/m]. */
  readonly max_damping: number;
  /** Whether gains follow the compliance under the probe; not those that the user has fixed. */
  readonly follow: boolean;
  /** Largest gain that the device renders stably [N/m]. */
  readonly max_stiffness: number;
}

/** The settings of a loop at a server with this period. */
export function loopSettings(simulation_period: number, max_force: number, stall: number): LoopSettings {
  return {
    simulation_period,
    limits: {
      ...DEFAULT_LIMITS,
      max_force,
      stall,
      // Three ticks, at least 0.1 s: jitter below that does not disturb the hand.
      silent_after: Math.max(0.1, 3 * simulation_period),
    },
    // The integral lets go over two simulation periods (5.1), but not faster than 1 % of it per millisecond.
    law: { ...DEFAULT_LAW_SETTINGS, release_time: Math.max(0.1, 2 * simulation_period), max_force },
    smoothing: 1,
    max_damping: 0,
    follow: true,
    max_stiffness: Infinity,
  };
}

/** Tip of a device in the world frame. */
export interface DeviceSample {
  /** [m] */
  readonly position: Vec3;
  /** [m/s] */
  readonly velocity: Vec3;
}

/** Memory of the loop. */
export interface LoopState {
  /** Newest patch; null before the first. */
  readonly patch: Patch | null;
  /** When it came [s]. */
  readonly arrived: number;
  readonly before: Patch | null;
  /** What was shown when the newest came, less what `before` shows. */
  readonly offset: Sight | null;
  /** Gain in use when it came [N/m]. */
  readonly k_h_before: number;
  /** Law in use; null before the first patch. */
  readonly fade: LawFade | null;
  /** Of the law in the last period [N]. */
  readonly normal_force: number;
  /** Shown in the last period; null before the first. */
  readonly sight: Sight | null;
  /** Of the last period [m]. */
  readonly probe: Vec3;
  readonly passivity: Passivity;
  readonly safety: SafetyState;
}

export const START: LoopState = {
  patch: null,
  arrived: -Infinity,
  before: null,
  offset: null,
  k_h_before: 0,
  fade: null,
  normal_force: 0,
  sight: null,
  probe: ZERO,
  passivity: NOTHING_OWED,
  safety: NOT_ENGAGED,
};

/** What a period gives. */
export interface Output {
  /** On the hand, to the device [N]. */
  readonly force: Vec3;
  /** The same without the passivity layer's damping, which is the hand's affair: what the body gets [N]. */
  readonly on_body: Vec3;
  readonly local: LocalForce;
  /** Of the passivity layer, along the normal [N]. */
  readonly damping_force: number;
  readonly silent: boolean;
}

/**
 * Take a patch in; an older one than the newest is left out.
 *
 * Surface and gain move to the new patch over one simulation period, from what is shown now.
 */
export function receive(state: LoopState, patch: Patch, now: number, settings: LoopSettings): LoopState {
  // After a silence it may be another server's: one that was started anew counts from 1.
  const stale = state.patch !== null && patch.tick <= state.patch.tick;
  if (stale && !isSilent(state, now, settings)) return state;
  const gains: Gains = { k_h: patch.k_h, integral_gain: patch.integral_gain };
  const fade =
    state.fade === null
      ? settled(patch.law, gains)
      : switchLaw(state.fade, patch.law, gains, state.normal_force, state.sight);
  const before = state.patch;
  const atArrival = shown(state, state.probe, now, settings);
  const offset = before !== null && atArrival !== null ? difference(atArrival, look(before, state.probe)) : null;
  return { ...state, patch, arrived: now, before, offset, k_h_before: fade.now.gains.k_h, fade };
}

/** What a probe sees at `now`, on the way from the patch before to the newest. */
export function shown(state: LoopState, probe: Vec3, now: number, settings: LoopSettings): Sight | null {
  if (state.patch === null) return null;
  const sight = look(state.patch, probe);
  const share = progress(state, now, settings);
  if (share >= 1 || state.before === null) return sight;
  return blend(shift(look(state.before, probe), state.offset), sight, share);
}

/** How far the way to the newest patch is gone, 0 to 1. */
function progress(state: LoopState, now: number, settings: LoopSettings): number {
  const way = settings.smoothing * settings.simulation_period;
  return way > 0 ? Math.min(1, (now - state.arrived) / way) : 1;
}

/** One haptic period: from a device's sample to the force it gets. */
export function step(
  state: LoopState,
  sample: DeviceSample,
  now: number,
  settings: LoopSettings,
): [state: LoopState, output: Output] {
  const dt = state.safety.now === null ? 0 : now - state.safety.now;
  const sight = shown(state, sample.position, now, settings);
  let local = NO_FORCE;
  let damped = 0;
  let fade = state.fade;
  let passivity = state.passivity;
  if (sight !== null && state.patch !== null && fade !== null) {
    if (state.patch.law === fade.now.law) {
      const newest = gainsUnder(state.patch, sight, settings);
      const target = state.k_h_before + progress(state, now, settings) * (newest.k_h - state.k_h_before);
      const k_h = slewGain(fade.now.gains.k_h, target, dt);
      fade = withGains(fade, { k_h, integral_gain: newest.integral_gain });
    }
    [fade, local] = run(fade, sight, dt, settings.law);
    [passivity, damped] = keepPassive(state, sample, sight, fade.now.law, local.normal_force, dt, settings);
  }
  const normal = sight === null ? ZERO : sight.normal;
  const wanted = scale(normal, damped);
  const silent = isSilent(state, now, settings);
  const safety = guard(state.safety, wanted, now, sample.velocity, silent, settings.limits);
  const size = norm(wanted);
  const given = size > 0 ? norm(safety.force) / size : safety.scale;
  return [
    {
      ...state,
      fade,
      normal_force: local.normal_force,
      sight,
      probe: sample.position,
      passivity,
      safety,
    },
    {
      force: safety.force,
      on_body: scale(scale(normal, local.normal_force), given),
      local,
      damping_force: damped - local.normal_force,
      silent,
    },
  ];
}

/**
 * The gains of a patch for the place where the probe is now: they are shares of 1 / C_ii, which is on its way from
 * the patch before to the newest.
 */
function gainsUnder(patch: Patch, sight: Sight, settings: LoopSettings): Gains {
  let ratio = 1;
  if (settings.follow && sight.c_ii > 0) {
    ratio = Math.min(MOST_CHANGE, Math.max(1 / MOST_CHANGE, patch.c_ii / sight.c_ii));
  }
  return {
    k_h: Math.min(patch.k_h * ratio, Math.max(settings.max_stiffness, patch.k_h)),
    integral_gain: patch.integral_gain * ratio,
  };
}

/** Memory of the layer, and the normal force with the passivity layer's damping [N]. */
function keepPassive(
  state: LoopState,
  sample: DeviceSample,
  sight: Sight,
  law: LawName,
  force: number,
  dt: number,
  settings: LoopSettings,
): [Passivity, number] {
  if (state.sight === null || settings.max_damping <= 0) return [NOTHING_OWED, force];
  // The probe's own way changes the depth too; what is left is the surface's.
  const deeper = pressedDepth(law, sight) - pressedDepth(law, state.sight);
  const moved = deeper + dot(sight.normal, sub(sample.position, state.probe));
  const owed = observe(state.passivity.owed, force, sight.own_force, moved, dt);
  const speedIn = -dot(sight.normal, sample.velocity);
  return dissipate({ owed, damping: state.passivity.damping }, force, speedIn, dt, settings.max_damping);
}

/** Whether the newest patch is so old that the server counts as silent. */
export function isSilent(state: LoopState, now: number, settings: LoopSettings): boolean {
  return now - state.arrived > settings.limits.silent_after;
}

/** Move a gain towards its target by at most `GAIN_RATE` of itself per second [N/m]. */
export function slewGain(k_h: number, target: number, dt: number): number {
  const factor = Math.exp(Math.min(1, GAIN_RATE * dt));
  return Math.min(Math.max(target, k_h / factor), k_h * factor);
}
