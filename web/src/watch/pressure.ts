/** Vertices under a contact's pressure, and the share of the force on each; `cohaptic_server/mesh/surface.py`. */

import type { Vec3 } from "../model/vec";
import type { Quadrature } from "../model/quadrature";

/** k vertices in rising order, with weights that sum to 1. */
export interface Pressure {
  readonly vertices: readonly number[];
  readonly weights: readonly number[];
}

/** Cosines between finger and surface: full pressure from the first on, no pressure below the second. */
const BESIDE = 0;
const BEHIND = -0.5;

/**
 * Pressure of a finger: it falls as 1 - (r / radius)^2 on the finger's side, and each quadrature point distributes its
 * part to the corners of its face.
 *
 * @param foot Centre of the pressure, on a facet of the resting mesh [m].
 * @param normal Outward unit normal of the finger.
 * @param radius Radius of the pressure [m]; below the mesh's resolution all pressure is on the nearest point.
 */
export function pressure(q: Quadrature, foot: Vec3, normal: Vec3, radius: number): Pressure {
  const parts = new Map<number, number>();
  let nearest = 0;
  let least = Infinity;
  const count = q.points.length / 3;
  for (let p = 0; p < count; p += 1) {
    const dx = (q.points[3 * p] ?? 0) - foot[0];
    const dy = (q.points[3 * p + 1] ?? 0) - foot[1];
    const dz = (q.points[3 * p + 2] ?? 0) - foot[2];
    const r2 = dx * dx + dy * dy + dz * dz;
    if (r2 < least) {
      least = r2;
      nearest = p;
    }
    if (r2 > radius * radius) continue;
    const facing = Math.min(1, (facingOf(q, p, normal) - BEHIND) / (BESIDE - BEHIND));
    if (facing > 0) hand(q, p, facing * Math.max(1 - r2 / (radius * radius), 1e-12), parts);
  }
  if (parts.size === 0) hand(q, nearest, 1, parts);
  const vertices = [...parts.keys()].filter((v) => (parts.get(v) ?? 0) > 0).sort((a, b) => a - b);
  const total = vertices.reduce((sum, v) => sum + (parts.get(v) ?? 0), 0);
  return { vertices, weights: vertices.map((v) => (parts.get(v) ?? 0) / total) };
}

function facingOf(q: Quadrature, point: number, normal: Vec3): number {
  const at = 3 * Math.floor(point / q.split);
  return normal.reduce((sum, n, axis) => sum + n * (q.outward[at + axis] ?? 0), 0);
}

/** Distribute a point's part of the force to the corners of its face. */
function hand(q: Quadrature, point: number, profile: number, parts: Map<number, number>): void {
  const face = Math.floor(point / q.split);
  const s = point % q.split;
  const part = profile * (q.areas[face] ?? 0);
  for (let c = 0; c < 3; c += 1) {
    const vertex = q.faces[3 * face + c] ?? 0;
    parts.set(vertex, (parts.get(vertex) ?? 0) + part * (q.shares[3 * s + c] ?? 0));
  }
}
