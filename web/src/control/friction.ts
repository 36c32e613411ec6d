/**
 * Coulomb friction at the local model, in the plane of contact, with the full contact compliance.
 *
 * `shared/cohaptic/control/friction.py` in TypeScript, where the equations are derived. While the probe sticks, its way
 * over the material equals the contact point's, s = -P C (n f_n + f_t) with P = I - n n'; where the tangential force
 * would exceed mu times the normal force, the probe slides. The anchor of a sticking contact is a point of the
 * material: others may drag it along, and the hand feels that (science 3.10).
 */

import type { Compliance3 } from "../model/body";
import { add, cross, dot, norm, scale, sub, unit, type Vec3, ZERO } from "../model/vec";

const ROUNDING = 1e-9; // fraction of the diagonal's product; the server sends no compliance that is so nearly singular
const WEDGE = 0.9; // fraction of the way in that friction may take back

/** Memory of the sticking contact. */
export interface FrictionState {
  /** s, the displacement of the tip relative to the material since it stuck [m]. */
  readonly stretch: Vec3;
  /** f_t on the hand [N]. */
  readonly force: Vec3;
  /** Displacement by the others of the material at the sticking contact, as far as the force has followed it [m]. */
  readonly material: Vec3;
  /** Whether there was contact in the last period. */
  readonly touching: boolean;
  /** Share of the body's stiffness that the friction's force uses; below 1 where the device is softer. */
  readonly fraction: number;
}

export const NO_FRICTION: FrictionState = { stretch: ZERO, force: ZERO, material: ZERO, touching: false, fraction: 1 };

/** C f [m]. */
export function times([xx, yy, zz, xy, xz, yz]: Compliance3, [x, y, z]: Vec3): Vec3 {
  return [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z];
}

/** Whether C is positive definite, as for any body: each force moves its point along with it (Sylvester's rule). */
export function isDefinite(C: Compliance3): boolean {
  const [xx, yy, zz, xy] = C;
  if (!(xx > 0 && yy > 0 && zz > 0)) return false;
  return xx * yy - xy * xy > ROUNDING * xx * yy && determinant(C) > ROUNDING * xx * yy * zz;
}

/** A bound from below for the smallest eigenvalue of a definite C [m/N]. */
export function leastEigenvalue(C: Compliance3): number {
  // The product of the other two eigenvalues is at most the square of half the trace.
  return (4 * determinant(C)) / (C[0] + C[1] + C[2]) ** 2;
}

function determinant([xx, yy, zz, xy, xz, yz]: Compliance3): number {
  return xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
}

/** Two unit vectors that make a right-handed frame with `normal`. */
export function tangents(normal: Vec3): [one: Vec3, two: Vec3] {
  const one = unit(cross(normal, Math.abs(normal[0]) < 0.7 ? [1, 0, 0] : [0, 1, 0]));
  return [one, cross(normal, one)];
}

/** Distance by which the tangential force moves the contact point away from the tip, n . C f_t [m]. */
export function normalShift(state: FrictionState, normal: Vec3, C: Compliance3): number {
  return dot(normal, times(C, state.force));
}

/** Share of `normalShift` that a law takes into its depth, above 0 and at most 1 (`believed_shift` of `friction.py`). */
export function believedShift(normal: Vec3, C: Compliance3, k_h: number): number {
  const gain = k_h * dot(normal, times(C, normal));
  return gain <= 1 ? 1 : 1 / gain;
}

/** The fraction of a normal force that comes back through friction, 0 to 0.9 (`wedging` of `friction.py`). */
export function wedging(mu: number, normal: Vec3, C: Compliance3, k_h: number): number {
  const moved = times(C, normal);
  const along = dot(moved, normal);
  if (along <= 0) return WEDGE;
  return Math.min(WEDGE, mu * norm(sub(moved, scale(normal, along))) * Math.min(k_h, 1 / along));
}

/** Point of the resting surface that the contact holds [m]; null without contact (`anchor_of` of `friction.py`). */
export function anchorOf(state: FrictionState, probe: Vec3, normal: Vec3, depth: number): Vec3 | null {
  if (!state.touching) return null;
  return sub(add(sub(probe, state.stretch), scale(normal, Math.max(0, depth))), state.material);
}

/**
 * How far the anchor goes with the material in this period.
 *
 * @param material Present displacement by the others of the material under the contact [m].
 * @param max_change Largest way in this period, so that the force of a contact at rest has no step [m].
 * @returns The way of the anchor in this period, and the displacement that it has followed [m].
 */
export function followMaterial(state: FrictionState, material: Vec3, max_change: number): [carried: Vec3, followed: Vec3] {
  if (!state.touching) return [ZERO, material];
  let gap = sub(material, state.material);
  const size = norm(gap);
  if (size > max_change) gap = scale(gap, max_change / size);
  return [gap, add(state.material, gap)];
}

/** Inputs of one period of stick and slip. */
export interface Slide {
  /** Way of the tip in this period [m]. */
  readonly moved: Vec3;
  /** Displacement by the others of the material under the contact [m]. */
  readonly material: Vec3;
  /** Outward unit normal at the contact. */
  readonly normal: Vec3;
  /** f_n on the hand [N]; 0 ends the contact. */
  readonly normal_force: number;
  /** Compliance of the contact. */
  readonly C: Compliance3;
  /** Coefficient of friction. */
  readonly mu: number;
  /** Share of the body's stiffness that the law may use, K_h C_ii. */
  readonly fraction: number;
  /** Largest stiffness that the device renders stably; no direction along the surface exceeds it [N/m]. */
  readonly max_stiffness: number;
  /** Largest change of the force by the others in this period [N]. */
  readonly max_change: number;
}

/** One period of stick and slip. */
export function frictionStep(state: FrictionState, slide: Slide): FrictionState {
  const { moved, material, normal, normal_force, C, max_stiffness } = slide;
  let { mu, max_change } = slide;
  if (normal_force <= 0 || mu <= 0 || slide.fraction <= 0) return NO_FRICTION;
  const [one, two] = tangents(normal);
  const along_n = times(C, scale(normal, normal_force));
  const b1 = dot(along_n, one);
  const b2 = dot(along_n, two);
  const c1 = times(C, one);
  const c11 = dot(c1, one);
  const c12 = dot(c1, two);
  const c22 = dot(times(C, two), two);
  const det = c11 * c22 - c12 * c12;
  if (c11 <= 0 || det <= 0) return NO_FRICTION; // not the compliance of an elastic body
  // Where friction would take the contact point away faster than the finger presses it in, the contact would wedge,
  // and its force grow without bound.
  const lifts = Math.hypot(b1, b2);
  const pressed_in = WEDGE * dot(along_n, normal);
  if (mu * lifts > pressed_in) mu = pressed_in / lifts;
  // Compliance of the stiffest direction, by the larger eigenvalue so that nothing cancels.
  const stiffest = det / (0.5 * (c11 + c22) + Math.hypot(0.5 * (c11 - c22), c12));
  let fraction = Math.min(slide.fraction, max_stiffness * stiffest);
  const held = norm(state.force);
  if (state.touching && held > 0) {
    // A change of the gain moves the friction too: it may take half of the allowed change.
    const reach = (0.5 * max_change) / held;
    fraction = Math.min(Math.max(fraction, state.fraction * (1 - reach)), state.fraction * (1 + reach));
    max_change = Math.max(0, max_change - held * Math.abs(fraction / state.fraction - 1)); // not below 0 by a rounding
  }
  const [carried, followed] = followMaterial(state, material, (max_change * stiffest) / fraction);
  // At first touch the friction starts from zero, whatever the normal force.
  const stretch = state.touching ? state.stretch : add(scale(one, -b1), scale(two, -b2));
  const way = sub(add(stretch, moved), carried);
  // In coordinates of the tangent plane, because the surface turns under the tip.
  let s1 = dot(way, one);
  let s2 = dot(way, two);
  const r1 = s1 + b1;
  const r2 = s2 + b2;
  let f1 = (-fraction * (c22 * r1 - c12 * r2)) / det;
  let f2 = (-fraction * (c11 * r2 - c12 * r1)) / det;
  const size = Math.hypot(f1, f2);
  const limit = mu * normal_force;
  if (size > limit) {
    // Slip: the contact follows until the friction that is left can hold it.
    f1 = (f1 * limit) / size;
    f2 = (f2 * limit) / size;
    s1 = -(c11 * f1 + c12 * f2) / fraction - b1;
    s2 = -(c12 * f1 + c22 * f2) / fraction - b2;
  }
  const at = (a: number, b: number): Vec3 => add(scale(one, a), scale(two, b));
  return { stretch: at(s1, s2), force: at(f1, f2), material: followed, touching: true, fraction };
}
