/**
 * Turns the camera off the normal during a press, because a dent is invisible when seen from straight in front.
 *
 * The camera turns about the pressed point, which therefore stays where it is in the picture, under the pointer. It
 * turns about the vertical, or about the horizontal of the picture, so that the picture stays level.
 */

import { add, cross, dot, norm, scale, sub, unit, type Vec3 } from "../../model/vec";

export interface Lean {
  /** The pressed point [m]. */
  readonly pivot: Vec3;
  /** Direction of the turn: to the side, or up over the point. */
  readonly way: "beside" | "above";
  /** Angle about the vertical, or about the picture's axis to the right [rad]. */
  readonly angle: number;
}

/** View of the body. */
export interface Sight {
  readonly eye: Vec3;
  /** Direction to the right of the picture; horizontal, of length 1. */
  readonly right: Vec3;
  /** Width of the picture over its height. */
  readonly aspect: number;
}

const DEGREE = Math.PI / 180;
/** Angle between the normal and the direction to the eye at which the depth of a dent is visible; more gains nothing. */
export const OBLIQUE = 40 * DEGREE;
/** Largest turn; beyond it the rest of the body would leave the picture. */
export const MOST = 30 * DEGREE;
const LEAST = 4 * DEGREE; // a smaller turn is not worth a motion
const STEEPEST = 75 * DEGREE; // largest angle of the eye above or below the pressed point; near the vertical a turn about it has no effect
const WIDE = 1; // aspect; narrower pictures have more room above than beside
const SECONDS = 0.25; // about as fast as a press goes in (`finger.ts`)
const VERTICAL: Vec3 = [0, 0, 1];

/**
 * The turn after which a pressed place is seen from the side; null if it is seen so already, or if no turn is better.
 *
 * @param normal Outward normal at the pressed point.
 * @param sees Whether the pressed point is visible from an eye, as parts of the body may be in between.
 */
export function leanOff(pivot: Vec3, normal: Vec3, { eye, right, aspect }: Sight, sees: (eye: Vec3) => boolean): Lean | null {
  const now = obliqueness(eye, pivot, normal);
  const angle = Math.min(MOST, OBLIQUE - now);
  if (!(angle >= LEAST)) return null;
  const from = (lean: Lean): Vec3 => turned(eye, lean, right);
  const gained = (lean: Lean): number => obliqueness(from(lean), pivot, normal) - now;
  const beside: Lean[] = [angle, -angle].map((turn) => ({ pivot, way: "beside", angle: turn }));
  const above: Lean = { pivot, way: "above", angle: -angle };
  beside.sort((a, b) => gained(b) - gained(a));
  const ways = aspect >= WIDE ? [...beside, above] : [above, ...beside];
  return ways.find((lean) => gained(lean) >= 0.5 * LEAST && steepness(from(lean), pivot) < STEEPEST && sees(from(lean))) ?? null;
}

/** Position of a point after a turn. */
export function turned(point: Vec3, { pivot, way, angle }: Lean, right: Vec3): Vec3 {
  return add(pivot, rotated(sub(point, pivot), axisOf(way, right), angle));
}

export function axisOf(way: Lean["way"], right: Vec3): Vec3 {
  return way === "beside" ? VERTICAL : right;
}

/** One step towards an angle; reaches it exactly, so that drawing can stop. */
export function leaning(from: number, to: number, dt: number): number {
  const next = to + (from - to) * Math.exp(-Math.max(0, dt) / SECONDS);
  return Math.abs(next - to) < 2e-3 ? to : next;
}

/** Rotate a vector about an axis of length 1 (Rodrigues). */
function rotated(a: Vec3, axis: Vec3, angle: number): Vec3 {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(scale(a, c), scale(cross(axis, a), s)), scale(axis, dot(axis, a) * (1 - c)));
}

function obliqueness(eye: Vec3, pivot: Vec3, normal: Vec3): number {
  return Math.acos(Math.min(1, Math.max(-1, dot(unit(sub(eye, pivot)), normal))));
}

function steepness(eye: Vec3, pivot: Vec3): number {
  const way = sub(eye, pivot);
  return Math.asin(Math.abs(way[2]) / Math.max(norm(way), 1e-12));
}
