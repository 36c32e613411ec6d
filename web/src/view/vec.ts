/** Three numbers. */

import type { Vec3 } from "../types";

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, s: number): Vec3 => [s * a[0], s * a[1], s * a[2]];
/** a + s b. */
export const along = (a: Vec3, s: number, b: Vec3): Vec3 => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const norm = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

/** In the same direction with length 1; `otherwise` where there is none. */
export function unit(a: Vec3, otherwise: Vec3 = [0, 0, 1]): Vec3 {
  const n = norm(a);
  return n > 1e-12 ? scale(a, 1 / n) : otherwise;
}

/** Row `i` of a shape (n, 3) array. */
export const row = (data: Float32Array, i: number): Vec3 => [data[3 * i] ?? 0, data[3 * i + 1] ?? 0, data[3 * i + 2] ?? 0];

/** From one direction towards another by at most `angle` [rad]; opposite ones turn about any axis. */
export function turn(from: Vec3, to: Vec3, angle: number): Vec3 {
  const cosine = Math.min(1, Math.max(-1, dot(from, to)));
  if (Math.acos(cosine) <= angle) return to;
  const side: Vec3 = Math.abs(from[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
  const across = cosine < -0.999 ? cross(from, side) : sub(to, scale(from, cosine));
  return unit(add(scale(from, Math.cos(angle)), scale(unit(across), Math.sin(angle))));
}
