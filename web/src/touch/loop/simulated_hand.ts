/** A simulated hand on a passive device: a spring pulls the hand after the cursor, so that it gives way to a force. */

import type { HandSettings } from "../../model/hand";
import { add, norm, scale, sub, type Vec3 } from "../../model/vec";

export const DEFAULT_HAND: HandSettings = { mass: 0.15, damping: 8, stiffness: 400 };

// A cursor may jump; a hand that followed it at once would exceed the safety layer's speed limit (1.5 m/s).
const REACH_SPEED = 0.6; // m/s

/** Tip of a simulated hand. */
export interface HandState {
  /** [m] */
  readonly position: Vec3;
  /** [m/s] */
  readonly velocity: Vec3;
}

/**
 * Advance a hand by `dt` under `force` on it; semi-implicit Euler, stable for dt <= 1 ms.
 *
 * `cohaptic.simulated.hand.move` in TypeScript.
 */
export function move(state: HandState, hand: HandSettings, target: Vec3, force: Vec3, dt: number): HandState {
  const { position: x, velocity: v } = state;
  const { stiffness: k, damping: b, mass: m } = hand;
  // The damping is implicit, so that no step is too long for it.
  const shrink = 1 / (1 + (b * dt) / m);
  const velocity: Vec3 = [
    (v[0] + (dt * (k * (target[0] - x[0]) + force[0])) / m) * shrink,
    (v[1] + (dt * (k * (target[1] - x[1]) + force[1])) / m) * shrink,
    (v[2] + (dt * (k * (target[2] - x[2]) + force[2])) / m) * shrink,
  ];
  return { position: add(x, scale(velocity, dt)), velocity };
}

/** The intended position on its way to the cursor, no faster than a hand reaches. */
export function reach(intended: Vec3, cursor: Vec3, dt: number): Vec3 {
  const way = sub(cursor, intended);
  const length = norm(way);
  const most = REACH_SPEED * dt;
  return length <= most ? cursor : add(intended, scale(way, most / length));
}
