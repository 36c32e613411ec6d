/**
 * Limits of the force for any output of law, network or device, and what the rules of `rules/guard.ts` remember.
 *
 * `client/cohaptic_client/loop/safety.py` in TypeScript. After a force that is not finite,
 * a stalled loop or too fast a hand, the hand is let go within `RELEASE_TIME`, without a jerk, and gets a force again only
 * after it has been out of the object. A silent server fades the force; its return raises it again. Any other force
 * is clamped, and its rate is limited up and down: a force that vanishes is as much of a jolt as one that comes.
 */

import { add, isFinite3, norm, scale, sub, type Vec3, ZERO } from "../../model/vec";

const RELEASE_TIME = 0.02; // s from a fault to zero force
/**
 * Largest rate of a change of force that the hand's own motion does not cause [N/s]: 0.02 N in a millisecond, which a
 * fingertip cannot tell from a steady force.
 */
export const EXTERNAL_RATE = 20;
/** Part of `EXTERNAL_RATE` for fades of this layer [N/s]; the rest is for motions of the surface. */
export const FADE_RATE = 10;
const LEAST_RATE = 1000; // N/s
const OWN_SPEED = 0.5; // m/s; speed of a hand that taps

/** Limits of the force on a hand. */
export interface SafetyLimits {
  /** Largest magnitude of the force [N]. */
  readonly max_force: number;
  /** Largest change of the force per second, up or down [N/s]. */
  readonly max_rate: number;
  /** Largest speed of the hand [m/s]. */
  readonly max_speed: number;
  /** A period longer than this is a fault [s]. */
  readonly stall: number;
  /** Time without a patch after which the server counts as silent [s]. */
  readonly silent_after: number;
  /** Time of the fade to zero when the server is silent; longer if `FADE_RATE` demands it [s]. */
  readonly fade_time: number;
  /** Time from zero to full force at the start and after a fault or a silence [s]. */
  readonly engage_time: number;
  /** Force that the law may ask for when the hand is first engaged [N]. */
  readonly engage_below: number;
  /** Number of periods for which the force must be below `engage_below`. */
  readonly engage_periods: number;
  /** Haptic period T; a late period moves the force by no more than two punctual ones would [s]. */
  readonly period: number;
}

export const DEFAULT_LIMITS: SafetyLimits = {
  max_force: 10,
  max_rate: LEAST_RATE,
  max_speed: 1.5,
  stall: 0.02,
  silent_after: 0.1,
  fade_time: 0.15,
  engage_time: 1,
  engage_below: 0.2,
  engage_periods: 4,
  period: 0.001,
};

/** `max_rate` for a device that renders this stiffness [N/m]: a hand that taps meets its own force in time [N/s]. */
export function rateOf(max_stiffness: number): number {
  return Math.max(LEAST_RATE, OWN_SPEED * max_stiffness);
}

/** Memory of the safety layer. */
export interface SafetyState {
  /** Whether the hand is engaged; it waits for that at the start and after every fault. */
  readonly engaged: boolean;
  /** Share of the requested force that is given, 0 to 1. */
  readonly scale: number;
  /** Force of the last period [N]. */
  readonly force: Vec3;
  /** Periods in a row in which the requested force was small. */
  readonly quiet: number;
  /** Time of the last period [s]; null before the first. */
  readonly now: number | null;
  /** Cause of the last return to waiting; empty for none. */
  readonly fault: string;
  /** Force at the fault, from which it is released [N]. */
  readonly released: Vec3;
  /** Share of the release that is still to come, 1 to 0. */
  readonly left: number;
}

export const NOT_ENGAGED: SafetyState = {
  engaged: false,
  scale: 0,
  force: ZERO,
  quiet: 0,
  now: null,
  fault: "",
  released: ZERO,
  left: 0,
};

/**
 * Share of the law's force after one period of a fade, 0 to 1.
 *
 * @param up Whether the force is to rise, or to fall.
 * @param size Magnitude of the whole force [N]; a fade changes it no faster than `FADE_RATE`.
 * @param time Time of a whole fade [s].
 * @param step Time that counts of this period [s].
 * @param fade_limit Largest change of the force, beside that rate [N].
 */
export function nextFraction(fraction: number, up: boolean, size: number, time: number, step: number, fade_limit = Infinity): number {
  let most = step / time;
  if (size > 0) most = Math.min(most, Math.min(FADE_RATE * step, fade_limit) / size);
  return up ? Math.min(1, fraction + most) : Math.max(0, fraction - most);
}

/** The requested force, or as much of it as a hand may get [N]. */
export function clamped(requested: Vec3, max_force: number): Vec3 {
  const size = norm(requested);
  return size > max_force ? scale(requested, max_force / size) : requested;
}

/** The wanted force, or the nearest to it within `most` of the one before [N]. */
export function towards(before: Vec3, wanted: Vec3, most: number): Vec3 {
  const change = sub(wanted, before);
  const jump = norm(change);
  return jump > most ? add(before, scale(change, most / jump)) : wanted;
}

/** Let a hand go after a fault: a smooth ramp from its force to zero. */
export function release(state: SafetyState, fault: string, step: number, now: number): SafetyState {
  const released = state.left > 0 ? state.released : state.force;
  const left = Math.max(0, (state.left > 0 ? state.left : 1) - step / RELEASE_TIME);
  const force = scale(released, left * left * (3 - 2 * left));
  return { ...NOT_ENGAGED, force, now, fault: fault === "" ? state.fault : fault, released, left };
}

/** Reason why the hand must be let go; empty for none. */
export function faultOf(requested: Vec3, velocity: Vec3, dt: number, limits: SafetyLimits): string {
  if (!isFinite3(requested)) return `the law asked for ${requested.join(", ")} N`;
  const speed = norm(velocity);
  if (!isFinite3(velocity) || speed > limits.max_speed) {
    return `the hand moved at ${speed.toFixed(2)} m/s, above ${limits.max_speed} m/s`;
  }
  if (dt > limits.stall) {
    return `the loop stood still for ${(1e3 * dt).toFixed(0)} ms, above ${1e3 * limits.stall} ms`;
  }
  return "";
}
