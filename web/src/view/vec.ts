/** More of three numbers than `../vec` has: what drawing and picking need. */

import type { Vec3 } from "../types";
import { add, cross, dot, scale, sub, unit } from "../vec";

/** a + s b. */
export function along(a: Vec3, s: number, b: Vec3): Vec3 {
  return [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
}

/** Row `i` of a shape (n, 3) array. */
export function row(data: Float32Array, i: number): Vec3 {
  return [data[3 * i] ?? 0, data[3 * i + 1] ?? 0, data[3 * i + 2] ?? 0];
}

/** From one direction towards another by at most `angle` [rad]; opposite ones turn about any axis. */
export function turn(from: Vec3, to: Vec3, angle: number): Vec3 {
  const cosine = Math.min(1, Math.max(-1, dot(from, to)));
  if (Math.acos(cosine) <= angle) return to;
  const side: Vec3 = Math.abs(from[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
  const across = cosine < -0.999 ? cross(from, side) : sub(to, scale(from, cosine));
  return unit(add(scale(from, Math.cos(angle)), scale(unit(across), Math.sin(angle))));
}
