/** The body that all touch. */

import type { Vec3 } from "./vec";

/** Symmetric, of a contact in all directions, world frame: xx, yy, zz, xy, xz, yz [m/N]. */
export type Compliance3 = readonly [number, number, number, number, number, number];

/** The body, as in `welcome` and `watching`. */
export interface BodyInfo {
  readonly name: string;
  /** Of the resting surface, world frame [m]. */
  readonly center: Vec3;
  /** Of the sphere round `center` that holds the resting surface [m]. */
  readonly radius: number;
  /** Of the pressure under a contact [m]. */
  readonly contact_radius: number;
}

/** How soon the object answers what the others do (science 3.8). */
export interface RoomLag {
  /** tau in use, 0 for none [s]. */
  readonly lag: number;
  /** m, the spectral radius of the coupling; below 1 no delay can make hands at rest swing. */
  readonly coupling: number;
  /** How far the room is from the edge of stability: above 1 it is stable. */
  readonly margin: number;
}

/** The resting surface: n vertices, m faces. */
export interface RestMesh {
  /** World frame, shape (n, 3) [m]. */
  readonly vertices: Float32Array;
  /** Counter-clockwise seen from outside, shape (m, 3). */
  readonly faces: Uint32Array;
}
