/** Where round the body the tour presses. */

import { dot, unit, type Vec3 } from "../model/vec";

const APART = 0.75; // rad that a guided hand keeps from others
const STEPS = 72; // places round the body that are looked at

export interface Other {
  /** Outward, from the middle of the body. */
  readonly direction: Vec3;
  /** How much its force moved in the last seconds [N]. */
  readonly busy: number;
}

/**
 * Opposite to the one who moves most, where the displaced material bulges out, or as near to that as the
 * others leave room; of two such places the one in sight.
 *
 * @param towardsEye From the middle of the body.
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
