/** Choice of the place on the body where the tour presses. */

import { dot, unit, type Vec3 } from "../model/vec";

const APART = 0.75; // rad that a guided hand keeps from others
const STEPS = 72; // places round the body that are compared

export interface Other {
  /** Direction of the press, outward from the middle of the body. */
  readonly direction: Vec3;
  /** Range of the user's force in the last seconds [N]. */
  readonly busy: number;
}

/**
 * Direction opposite to the user whose force moves most, where the displaced material bulges out, or as near to
 * that as the others leave room; of two such directions the one nearer to the eye.
 *
 * @param towardsEye Direction from the middle of the body towards the eye.
 */
export function guidedDirection(others: readonly Other[], towardsEye: Vec3): Vec3 {
  if (others.length === 0) return unit([towardsEye[0], towardsEye[1], 0], [0, -1, 0]);
  const busiest = others.reduce((a, b) => (b.busy > a.busy ? b : a));
  let best: Vec3 = [0, -1, 0];
  let most = -Infinity;
  for (let i = 0; i < STEPS; i++) {
    const angle = (2 * Math.PI * i) / STEPS;
    const d: Vec3 = [Math.cos(angle), Math.sin(angle), 0];
    const nearest = Math.min(...others.map((other) => apart(d, other.direction)));
    const score = 10 * Math.min(nearest, APART) + apart(d, busiest.direction) + 0.2 * dot(d, towardsEye);
    if (score > most) {
      most = score;
      best = d;
    }
  }
  return best;
}

function apart(a: Vec3, b: Vec3): number {
  return Math.acos(Math.min(1, Math.max(-1, dot(a, b))));
}
