/** Finds the place where a ray from the eye meets the present surface. */

import { along, cross, dot, row, sub, type Vec3 } from "../../model/vec";

/** A place on a triangle mesh that stays with the material as it deforms. */
export interface Place {
  readonly face: number;
  /** Barycentric weights of the face's corners; they sum to 1. */
  readonly shares: Vec3;
}

export interface Hit extends Place {
  readonly point: Vec3;
  /** Distance from the ray's origin [m]. */
  readonly distance: number;
}

/**
 * The first front side that a ray meets (Moeller and Trumbore); null if it meets none.
 *
 * @param positions Vertices, shape (n, 3) [m].
 * @param faces Corners, shape (m, 3).
 * @param direction Direction of the ray, of length 1.
 */
export function pick(positions: Float32Array, faces: Uint32Array, origin: Vec3, direction: Vec3): Hit | null {
  let best: Hit | null = null;
  for (let f = 0; f < faces.length / 3; f++) {
    const a = row(positions, faces[3 * f] ?? 0);
    const ab = sub(row(positions, faces[3 * f + 1] ?? 0), a);
    const ac = sub(row(positions, faces[3 * f + 2] ?? 0), a);
    const p = cross(direction, ac);
    const det = dot(ab, p);
    // Sides seen from behind have a negative determinant.
    if (det < 1e-14) continue;
    const from = sub(origin, a);
    const u = dot(from, p) / det;
    if (u < 0 || u > 1) continue;
    const q = cross(from, ab);
    const v = dot(direction, q) / det;
    if (v < 0 || u + v > 1) continue;
    const distance = dot(ac, q) / det;
    if (distance <= 0 || (best !== null && distance >= best.distance)) continue;
    best = { face: f, shares: [1 - u - v, u, v], point: along(origin, distance, direction), distance };
  }
  return best;
}

/** Weighted mean of a face's three rows of `data` (n, 3) at a place: a point, or a normal not yet of length 1. */
export function at(data: Float32Array, faces: Uint32Array, place: Place): Vec3 {
  let out: Vec3 = [0, 0, 0];
  for (let k = 0; k < 3; k++) {
    out = along(out, place.shares[k] ?? 0, row(data, faces[3 * place.face + k] ?? 0));
  }
  return out;
}

/** The outermost place on the surface in a direction from `center`, which a ray from outside would meet. */
export function placeTowards(
  positions: Float32Array,
  faces: Uint32Array,
  center: Vec3,
  direction: Vec3,
  radius: number,
): Place | null {
  const origin = along(center, 4 * radius, direction);
  return pick(positions, faces, origin, [-direction[0], -direction[1], -direction[2]]);
}
