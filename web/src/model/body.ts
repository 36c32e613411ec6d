/** The body that everybody touches, and its compliance. */

import type { Vec3 } from "./vec";

/** Compliance of a contact in all directions, symmetric, world frame: xx, yy, zz, xy, xz, yz [m/N]. */
export type Compliance3 = readonly [number, number, number, number, number, number];

/** The body, as in `welcome` and `watching`; its `origin` in a file is of no use to the page. */
export interface BodyInfo {
  readonly name: string;
  /** Centre of the resting surface, world frame [m]. */
  readonly center: Vec3;
  /** Radius of the sphere round `center` that encloses the resting surface [m]. */
  readonly radius: number;
  /** Radius of the pressure distribution of a contact [m]. */
  readonly contact_radius: number;
}

/** Response of the object to the forces of the others: its lag and what determines it (science 3.8). */
export interface RoomLag {
  /** Time constant tau of the low-pass filter on forces, 0 for none [s]. */
  readonly lag: number;
  /** m, the spectral radius of the coupling; below 1 hands at rest are stable at any delay. */
  readonly coupling: number;
  /** Stability margin of the room: above 1 it is stable. */
  readonly margin: number;
}

/** The resting surface: n vertices, m faces. */
export interface RestMesh {
  /** World frame, shape (n, 3) [m]. */
  readonly vertices: Float32Array;
  /** Counter-clockwise seen from outside, shape (m, 3). */
  readonly faces: Uint32Array;
}

/** Whether two meshes are those of the same object: a page that reconnects reads the mesh anew. */
export function sameMesh(a: RestMesh, b: RestMesh): boolean {
  const same = (p: Float32Array | Uint32Array, q: Float32Array | Uint32Array): boolean => p.length === q.length && p.every((x, i) => x === q[i]);
  return same(a.vertices, b.vertices) && same(a.faces, b.faces);
}
