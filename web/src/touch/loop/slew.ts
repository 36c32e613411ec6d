/**
 * Slew limits of the changes of force that the hand's own motion does not cause.
 *
 * `client/cohaptic_client/loop/slew.py` in TypeScript: `EXTERNAL_RATE` is for all of it; depth, direction, gain and
 * compliance of a contact each move as fast as their share of it allows.
 */

import { leastEigenvalue, tangents } from "../../control/friction";
import type { Compliance3 } from "../../model/body";
import { add, dot, norm, scale, sub, unit, type Vec3 } from "../../model/vec";
import { EXTERNAL_RATE } from "./safety";
import type { LoopState } from "./state";

// A gain moves by at most 1 % per millisecond, and by `EXTERNAL_RATE` as far as the force knows.
const GAIN_RATE = 10; // 1/s
export const SOFT = 1; // N/m; a softer contact has no force that could step, and a gain of 0 would stay 0

/**
 * Depth on which the law presses; motion of the surface by the others changes it by `most` at most [m].
 *
 * @param depth Of the last period, and the way that the hand itself went in since [m].
 * @param target Of the probe below the surface that is shown [m].
 * @param most Way of the surface in this period [m].
 */
export function holdBack(depth: number, target: number, most: number): number {
  if (depth <= 0 && target <= 0) return target; // out of contact there is no force to move
  const start = Math.max(0, depth); // from where on there is one
  return Math.min(Math.max(target, start - most), start + most);
}

/**
 * Direction of the force; motion of the surface by the others turns it by `most` at most.
 *
 * @param normal Of the last period.
 * @param target Of the surface that is shown.
 * @param most Turn in this period [rad].
 * @returns Unit normal to be used, and by how much it turned [rad].
 */
export function turnBack(normal: Vec3, target: Vec3, most: number): [normal: Vec3, turn: number] {
  const along = dot(normal, target);
  // By its square too: a normal of 32 bits is no exact unit vector, and what that leaves along an opposite target would
  // pass for a way there.
  const aside = sub(target, scale(normal, along / dot(normal, normal)));
  const size = norm(aside);
  const angle = Math.atan2(size, along);
  if (angle <= most) return [target, angle];
  // To the opposite direction every way is as short as any other.
  const way = size > 1e-9 ? scale(aside, 1 / size) : tangents(normal)[0];
  return [unit(add(scale(normal, Math.cos(most)), scale(way, Math.sin(most)))), most];
}

/**
 * Direction of the force in this period, and the part of the pace that remains for its size [N].
 *
 * The hand's own way along the surface turns the force as far as that way makes force. Half of the pace is left to the
 * size in any case.
 *
 * @param moved Way of the hand in this period [m].
 * @param force On the hand, above 0 [N].
 * @param pace Largest change of the force by the others in this period [N].
 */
export function slewNormal(
  before: Vec3,
  target: Vec3,
  moved: Vec3,
  k_h: number,
  force: number,
  pace: number,
): [normal: Vec3, pace: number] {
  const own = k_h * norm(sub(moved, scale(before, dot(before, moved))));
  const [normal, turn] = turnBack(before, target, (0.5 * pace + own) / force);
  return [normal, pace - Math.max(0, turn * force - own)];
}

/**
 * Move a gain towards its target by at most `GAIN_RATE` of itself per second [N/m].
 *
 * @param force That it makes now; it changes by at most half of `EXTERNAL_RATE` [N].
 */
export function slewGain(k_h: number, target: number, dt: number, force = 0): number {
  const rate = force > 0 ? Math.min(GAIN_RATE, (0.5 * EXTERNAL_RATE) / force) : GAIN_RATE;
  const factor = Math.exp(Math.min(1, rate * dt));
  return Math.min(Math.max(target, k_h / factor), Math.max(k_h, SOFT) * factor);
}

/**
 * Compliance that the friction uses, on its way to the newest patch's [m/N].
 *
 * A patch without a compliance keeps the previous one: a sticking contact does not let go because of it.
 *
 * @param most By how much the change of it may change the force in this period [N].
 */
export function slewCompliance(state: LoopState, most: number, counted: number, period: number): Compliance3 | null {
  const previous = state.compliance;
  const newest = state.patch?.compliance ?? null;
  if (newest === null || previous === null || !state.friction.touching) return newest ?? previous;
  const change = Math.hypot(...previous.map((a, i) => (newest[i] ?? a) - a));
  if (change === 0) return newest;
  let s = counted / period;
  // f = C^-1 x, so a change of C moves it by at most |dC| |f| over the least eigenvalue of C.
  const force = Math.hypot(state.normal_force, norm(state.friction.force));
  if (force > 0) s = Math.min(s, (most * leastEigenvalue(previous)) / (Math.SQRT2 * change * force));
  if (s >= 1) return newest;
  const [xx, yy, zz, xy, xz, yz] = newest;
  const mid = (a: number, b: number): number => a + s * (b - a);
  return [mid(previous[0], xx), mid(previous[1], yy), mid(previous[2], zz), mid(previous[3], xy), mid(previous[4], xz), mid(previous[5], yz)];
}
