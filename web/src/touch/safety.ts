/**
 * The last thing before the device: limits that hold whatever law, network or device did.
 *
 * One function, applied once; `client/cohaptic_client/safety.py` in TypeScript. A force that is not finite, a stalled
 * loop or a hand that moves too fast means zero at once, and force again only after the hand has been out of the
 * object. A silent server fades the force; its return raises it again. What is left is clamped and limited in its rate.
 */

import type { Vec3 } from "../types";
import { add, dot, isFinite3, norm, scale, sub, ZERO } from "../vec";

/** What a hand may be given. */
export interface SafetyLimits {
  /** Magnitude [N]. */
  readonly max_force: number;
  /** Change per second; never limits a change towards zero [N/s]. */
  readonly max_rate: number;
  /** Of the hand [m/s]. */
  readonly max_speed: number;
  /** A period longer than this is a fault [s]. */
  readonly stall: number;
  /** Without a patch for this long the server counts as silent [s]. */
  readonly silent_after: number;
  /** From full force to none when it is [s]. */
  readonly fade_time: number;
  /** From none to full at the start and after a fault or silence [s]. */
  readonly engage_time: number;
  /** Force that the law may ask for when the hand is first engaged [N]. */
  readonly engage_below: number;
  /** For how many periods it must be below that. */
  readonly engage_periods: number;
}

export const DEFAULT_LIMITS: SafetyLimits = {
  max_force: 10,
  max_rate: 1000,
  max_speed: 1.5,
  stall: 0.02,
  silent_after: 0.1,
  fade_time: 0.15,
  engage_time: 1,
  engage_below: 0.2,
  engage_periods: 4,
};

/** Memory of the safety layer. */
export interface SafetyState {
  /** Whether the hand is engaged; it waits at the start and after every fault. */
  readonly engaged: boolean;
  /** Share of the wanted force that is given, 0 to 1. */
  readonly scale: number;
  /** Given in the last period [N]. */
  readonly force: Vec3;
  /** Periods in a row in which the wanted force was small. */
  readonly quiet: number;
  /** Time of the last period [s]; null before the first. */
  readonly now: number | null;
  /** What caused the last return to waiting; empty for none. */
  readonly fault: string;
}

export const NOT_ENGAGED: SafetyState = { engaged: false, scale: 0, force: ZERO, quiet: 0, now: null, fault: "" };

/**
 * The force that the device gets, as `force` of the next state.
 *
 * @param wanted Force that the law asks for [N].
 * @param now Time of this period [s].
 * @param velocity Of the hand [m/s].
 * @param silent Whether the server has been silent for too long.
 */
export function guard(
  state: SafetyState,
  wanted: Vec3,
  now: number,
  velocity: Vec3,
  silent: boolean,
  limits: SafetyLimits,
): SafetyState {
  const dt = state.now === null ? 0 : now - state.now;
  const fault = faultOf(wanted, velocity, dt, limits);
  if (fault !== "") return { ...NOT_ENGAGED, now, fault };
  const size = norm(wanted);
  const quiet = size < limits.engage_below ? state.quiet + 1 : 0;
  const engaged = state.engaged || (quiet >= limits.engage_periods && !silent);
  const share =
    engaged && !silent
      ? Math.min(1, state.scale + dt / limits.engage_time)
      : Math.max(0, state.scale - dt / limits.fade_time);
  let force = scale(wanted, share);
  if (size * share > limits.max_force) force = scale(wanted, limits.max_force / size);
  force = limitRate(state.force, force, limits.max_rate * dt);
  return { engaged, scale: share, force, quiet, now, fault: engaged ? "" : state.fault };
}

/** Why the force must be zero now; empty when it need not. */
function faultOf(wanted: Vec3, velocity: Vec3, dt: number, limits: SafetyLimits): string {
  if (!isFinite3(wanted)) return `the law asked for ${wanted.join(", ")} N`;
  const speed = norm(velocity);
  if (!isFinite3(velocity) || speed > limits.max_speed) {
    return `the hand moved at ${speed.toFixed(2)} m/s, above ${limits.max_speed} m/s`;
  }
  if (dt > limits.stall) {
    return `the loop stood still for ${(1e3 * dt).toFixed(0)} ms, above ${1e3 * limits.stall} ms`;
  }
  return "";
}

/** Move from `before` to `after` by at most `step`, the way towards zero not counted. */
function limitRate(before: Vec3, after: Vec3, step: number): Vec3 {
  const size2 = dot(before, before);
  // The nearest to `after` on the way from `before` to zero: as far as that, nothing holds back.
  const share = size2 > 0 ? Math.min(1, Math.max(0, dot(after, before) / size2)) : 0;
  const start = scale(before, share);
  const change = sub(after, start);
  const size = norm(change);
  return size <= step ? after : add(start, scale(change, step / size));
}
