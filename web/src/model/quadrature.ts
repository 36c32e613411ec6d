/** Points spread evenly over the resting surface, for pressures that do not end at a vertex; `mesh/surface.py`. */

import type { RestMesh } from "./body";
import { scale, type Vec3 } from "./vec";

/** Each face carries SPLIT squared points: the centroids of equal triangles. */
const SPLIT = 3;
/** On a mesh of more faces than this a contact covers so many faces that one point in each is enough. */
const FINE = 10_000;

/** q points, in the order of the faces. */
export interface Quadrature {
  /** Shape (q, 3) [m]. */
  readonly points: Float64Array;
  /** Share of the surface that each point of a face stands for, shape (m,) [m^2]. */
  readonly areas: Float64Array;
  /** Outward unit normal of each face, shape (m, 3). */
  readonly outward: Float64Array;
  /** Barycentric coordinates of a face's points, shape (split, 3). */
  readonly shares: Float64Array;
  /** Corners of each face, shape (m, 3). */
  readonly faces: Uint32Array;
  /** Points on each face. */
  readonly split: number;
}

export function quadratureOf({ vertices, faces }: RestMesh): Quadrature {
  const count = faces.length / 3;
  const shares = barycentric(count <= FINE ? SPLIT : 1);
  const split = shares.length / 3;
  const points = new Float64Array(3 * split * count);
  const areas = new Float64Array(count);
  const outward = new Float64Array(3 * count);
  const corner = (f: number, c: number, axis: number): number => vertices[3 * (faces[3 * f + c] ?? 0) + axis] ?? 0;
  for (let f = 0; f < count; f += 1) {
    const u: number[] = [];
    const v: number[] = [];
    for (let axis = 0; axis < 3; axis += 1) {
      const [a, b, c] = [corner(f, 0, axis), corner(f, 1, axis), corner(f, 2, axis)];
      u.push(b - a);
      v.push(c - a);
      for (let s = 0; s < split; s += 1) {
        const [wa, wb, wc] = [shares[3 * s] ?? 0, shares[3 * s + 1] ?? 0, shares[3 * s + 2] ?? 0];
        points[3 * (f * split + s) + axis] = wa * a + wb * b + wc * c;
      }
    }
    const [ux = 0, uy = 0, uz = 0] = u;
    const [vx = 0, vy = 0, vz = 0] = v;
    const normal: Vec3 = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const double = Math.hypot(...normal);
    areas[f] = (0.5 * double) / split;
    outward.set(double > 0 ? scale(normal, 1 / double) : normal, 3 * f);
  }
  return { points, areas, outward, shares, faces, split };
}

/** Centroids of parts^2 equal triangles, shape (parts^2, 3). */
function barycentric(parts: number): Float64Array {
  const rows: number[] = [];
  for (let i = 0; i < parts; i += 1) {
    for (let j = 0; i + j < parts; j += 1) {
      for (const third of i + j < parts - 1 ? [1, 2] : [1]) {
        const a = (i + third / 3) / parts;
        const b = (j + third / 3) / parts;
        rows.push(a, b, 1 - a - b);
      }
    }
  }
  return Float64Array.from(rows);
}
