/**
 * The target position of the hand, from presses and drags of a pointer.
 *
 * A press grasps the surface as it is at that moment and goes in gently along the normal, to a depth that wheel, Shift
 * and a pen's pressure change; a drag slides. Places are on the resting surface, so that the own dent does not draw the
 * finger further in. The way to another place goes round the body and not through it.
 */

import { add, along, dot, norm, scale, sub, turn, unit, type Vec3 } from "../../model/vec";

/** All lengths here in radii of the body. */
export const DEPTH = { usual: 0.18, least: 0.01, most: 0.5, notch: 0.02, pen: 0.4, clearance: 0.08 } as const;
const RISE = 0.3; // s to reach 2/3 of the depth
const TAU = 0.05; // s by which the tip lags behind its goal
const SPEED = 2.5; // radii per second, largest speed at the surface
const FLIGHT = 6; // radii per second, speed on the way round the body
const FAR = 0.45; // rad; a longer way goes round the body
const ORBIT = 1.12; // radii from the middle; height of the way round the body

/** Target of the hand. */
export interface Finger {
  /** Place on the resting surface [m]; `normal` is the outward normal there. */
  readonly surface: Vec3;
  readonly normal: Vec3;
  /** Height of the surface over the resting one when it was grasped, along the normal [m]. */
  readonly offset: number;
  readonly pressing: boolean;
  /** Time at which the press began [s]. */
  readonly since: number;
  /** Target depth below the grasped surface, in radii. */
  readonly depth: number;
}

export interface Place3 {
  readonly surface: Vec3;
  readonly normal: Vec3;
  /** Point of the present surface at this place [m]. */
  readonly point: Vec3;
}

export function hover(at: Place3, depth: number = DEPTH.usual): Finger {
  const offset = dot(sub(at.point, at.surface), at.normal);
  return { surface: at.surface, normal: at.normal, offset, pressing: false, since: 0, depth };
}

export function press(at: Place3, now: number, depth: number = DEPTH.usual): Finger {
  return { ...hover(at, depth), pressing: true, since: now };
}

/** Slide: change the place and keep the height at which the surface was grasped. */
export function slide(finger: Finger, at: Place3): Finger {
  return finger.pressing ? { ...finger, surface: at.surface, normal: at.normal } : hover(at, finger.depth);
}

export function release(finger: Finger): Finger {
  return { ...finger, pressing: false };
}

/** @param by Change of the depth in radii; positive is deeper. */
export function deeper(finger: Finger, by: number): Finger {
  return { ...finger, depth: Math.min(DEPTH.most, Math.max(DEPTH.least, finger.depth + by)) };
}

/** Depth for the pressure of a pen, 0 to 1; even a light touch gives some depth. */
export function penDepth(pressure: number): number {
  const p = Math.min(1, Math.max(0, pressure));
  return Math.max(DEPTH.least, DEPTH.pen * p);
}

/** Target of the tip at time `now` [m]. */
export function goal(finger: Finger, now: number, radius: number): Vec3 {
  const depth = finger.depth * (1 - Math.exp(-Math.max(0, now - finger.since) / RISE));
  const height = finger.pressing ? -depth : DEPTH.clearance;
  return along(finger.surface, finger.offset + height * radius, finger.normal);
}

/** Move the tip straight along `towards` for `dt`, until it is `far` from the body's middle [m]. */
export function depart(tip: Vec3, towards: Vec3, center: Vec3, radius: number, far: number, dt: number): Vec3 {
  const from = sub(tip, center);
  const [height, out] = [norm(from), dot(from, towards)];
  if (height >= far) return tip;
  // To the sphere, along the line: the larger root of |from + s towards| = far.
  const left = -out + Math.sqrt(out * out + far * far - height * height);
  return along(tip, Math.min(left, SPEED * radius * dt), towards);
}

/**
 * Move the tip towards its goal for `dt`.
 *
 * @param tip Present position of the tip [m].
 * @param center Centre of the body; `radius` is its radius [m].
 */
export function follow(tip: Vec3, to: Vec3, center: Vec3, radius: number, dt: number): Vec3 {
  const out = unit(sub(tip, center));
  const there = unit(sub(to, center), out);
  const height = norm(sub(tip, center));
  const apart = Math.acos(Math.min(1, Math.max(-1, dot(out, there))));
  if (apart > FAR) {
    // First up to the height of the way round, then along it; by rounding, the tip may stay just below that height.
    const risen = Math.max(height, Math.min(ORBIT * radius, height + SPEED * radius * dt));
    return along(center, risen, risen < ORBIT * radius ? out : turn(out, there, (FLIGHT * radius * dt) / risen));
  }
  const way = sub(to, tip);
  const length = norm(way);
  const step = Math.min(length * (1 - Math.exp(-dt / TAU)), SPEED * radius * dt);
  return length < 1e-9 ? to : add(tip, scale(way, step / length));
}
