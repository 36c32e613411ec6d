/** Vectors of three numbers and their arithmetic; `shared/cohaptic/vec.py` in TypeScript. */

export type Vec3 = readonly [number, number, number];

export const ZERO: Vec3 = [0, 0, 0];
const UP: Vec3 = [0, 0, 1];

export function add(a: Vec3, b: Vec3): Vec3 {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

/** a - b. */
export function sub(a: Vec3, b: Vec3): Vec3 {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

export function scale(a: Vec3, s: number): Vec3 {
  return [a[0] * s, a[1] * s, a[2] * s];
}

export function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function cross(a: Vec3, b: Vec3): Vec3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function norm(a: Vec3): number {
  return Math.sqrt(dot(a, a));
}

/** Direction of `a`; `fallback` where `a` has none. */
export function unit(a: Vec3, fallback: Vec3 = UP): Vec3 {
  const length = norm(a);
  return length > 1e-12 ? scale(a, 1 / length) : fallback;
}

/** Straight line from a (s = 0) to b (s = 1). */
export function lerp(a: Vec3, b: Vec3, s: number): Vec3 {
  return [a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2])];
}

export function isFinite3(a: Vec3): boolean {
  return Number.isFinite(a[0]) && Number.isFinite(a[1]) && Number.isFinite(a[2]);
}

/** a + s b. */
export function along(a: Vec3, s: number, b: Vec3): Vec3 {
  return [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
}

/** Row `i` of a shape (n, 3) array. */
export function row(data: Float32Array, i: number): Vec3 {
  return [data[3 * i] ?? 0, data[3 * i + 1] ?? 0, data[3 * i + 2] ?? 0];
}

/** Turn one direction towards another by at most `angle` [rad]; opposite directions turn about any axis. */
export function turn(from: Vec3, to: Vec3, angle: number): Vec3 {
  const cosine = Math.min(1, Math.max(-1, dot(from, to)));
  if (Math.acos(cosine) <= angle) return to;
  const side: Vec3 = Math.abs(from[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
  const across = cosine < -0.999 ? cross(from, side) : sub(to, scale(from, cosine));
  return unit(add(scale(from, Math.cos(angle)), scale(unit(across), Math.sin(angle))));
}
