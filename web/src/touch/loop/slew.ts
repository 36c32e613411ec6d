/**
 * Slew limits of the changes of force that the hand's own motion does not cause.
 *
 * `client/cohaptic_client/loop/slew.py` in TypeScript: all these changes together stay within `EXTERNAL_RATE`; depth,
 * direction, gain and compliance of a contact each have a fraction of it.
 */

import { leastEigenvalue, tangents } from "../../control/friction";
import type { Compliance3 } from "../../model/body";
import { add, dot, norm, scale, sub, unit, type Vec3 } from "../../model/vec";
import { EXTERNAL_RATE } from "./safety";
import type { LoopState } from "./state";

// A gain changes by at most 1 % per millisecond, and changes the force by at most its fraction of `EXTERNAL_RATE`.
const GAIN_RATE = 10; // 1/s
export const SOFT = 1; // N/m; a softer contact has no force that could jump, and a gain of 0 would stay 0

/**
 * Depth on which the law presses; motion of the surface by the others changes it by `most` at most [m].
 *
 * @param depth Depth of the last period plus the way that the hand itself went in since [m].
 * @param target Depth of the probe below the surface in use [m].
 * @param most Largest way of the surface in this period [m].
 */
export function holdBack(depth: number, target: number, most: number): number {
  if (depth <= 0 && target <= 0) return target; // out of contact there is no force to move
  const start = Math.max(0, depth); // the depth from which on there is a force
  return Math.min(Math.max(target, start - most), start + most);
}

/**
 * Direction of the force; motion of the surface by the others turns it by `most` at most.
 *
 * @param normal Direction of the last period.
 * @param target Normal of the surface in use.
 * @param most Largest turn in this period [rad].
 * @returns Unit normal to be used, and by how much it turned [rad].
 */
export function turnBack(normal: Vec3, target: Vec3, most: number): [normal: Vec3, turn: number] {
  const along = dot(normal, target);
  // Divided by the normal's square, because a normal of 32 bits is no exact unit vector: for an opposite target the error
  // would look like a direction to turn to.
  const aside = sub(target, scale(normal, along / dot(normal, normal)));
  const size = norm(aside);
  const angle = Math.atan2(size, along);
  if (angle <= most) return [target, angle];
  // All ways to the opposite direction are equally short.
  const way = size > 1e-9 ? scale(aside, 1 / size) : tangents(normal)[0];
  return [unit(add(scale(normal, Math.cos(most)), scale(way, Math.sin(most)))), most];
}

/**
 * Direction of the force in this period, and by how much others turned it [N].
 *
 * The hand's own way along the surface may turn the force as far as that way produces force. At least half of the budget
 * is left for the size.
 *
 * @param moved Way of the hand in this period [m].
 * @param force Force on the hand, above 0 [N].
 * @param left What is left of the budget [N].
 */
export function slewNormal(
  before: Vec3,
  target: Vec3,
  moved: Vec3,
  k_h: number,
  force: number,
  left: number,
): [normal: Vec3, turned: number] {
  const own = k_h * norm(sub(moved, scale(before, dot(before, moved))));
  const [normal, turn] = turnBack(before, target, (0.5 * left + own) / force);
  return [normal, Math.max(0, turn * force - own)];
}

/**
 * Move a gain towards its target by at most `GAIN_RATE` of itself per second [N/m].
 *
 * @param force Present force of the gain; it changes by at most half of `EXTERNAL_RATE` [N].
 */
export function slewGain(k_h: number, target: number, dt: number, force = 0): number {
  const rate = force > 0 ? Math.min(GAIN_RATE, (0.5 * EXTERNAL_RATE) / force) : GAIN_RATE;
  const factor = Math.exp(Math.min(1, rate * dt));
  return Math.min(Math.max(target, k_h / factor), Math.max(k_h, SOFT) * factor);
}

/**
 * Compliance that the friction uses, in transition to that of the newest patch [m/N].
 *
 * A patch without a compliance keeps the previous one: a sticking contact does not let go because of it.
 *
 * @param most Largest change of the force by the compliance in this period [N].
 */
export function slewCompliance(state: LoopState, most: number, counted: number, period: number): Compliance3 | null {
  const previous = state.compliance;
  const newest = state.patch?.compliance ?? null;
  if (newest === null || previous === null || !state.friction.touching) return newest ?? previous;
  const change = Math.hypot(...previous.map((a, i) => (newest[i] ?? a) - a));
  if (change === 0) return newest;
  let s = counted / period;
  // f = C^-1 x, so a change of C changes f by at most |dC| |f| over the least eigenvalue of C.
  const force = Math.hypot(state.normal_force, norm(state.friction.force));
  if (force > 0) s = Math.min(s, (most * leastEigenvalue(previous)) / (Math.SQRT2 * change * force));
  if (s >= 1) return newest;
  const [xx, yy, zz, xy, xz, yz] = newest;
  const mid = (a: number, b: number): number => a + s * (b - a);
  return [mid(previous[0], xx), mid(previous[1], yy), mid(previous[2], zz), mid(previous[3], xy), mid(previous[4], xz), mid(previous[5], yz)];
}
