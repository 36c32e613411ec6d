/** Green's functions of the body, and the surface that results from forces: displacement = - sum of w f G. */

import { norm, type Vec3 } from "../model/vec";
import { ProtocolError } from "../protocol/frame";
import { pressure, type Pressure } from "./pressure";
import type { Quadrature } from "../model/quadrature";

const LEAST_FORCE = 1e-6; // N; a smaller force has no visible effect

/** One vertex's Green's functions: displacement of all n vertices for a unit force along each axis. */
export interface Block {
  /** One unit of `units` [m/N]. */
  readonly scale: number;
  /** Displacements by axis of the force, vertex, and axis of the displacement, shape (3, n, 3) [scale]. */
  readonly units: Int16Array;
}

/** Length of one block of a body with this many vertices [bytes]. */
export function blockSize(vertices: number): number {
  return 4 + 18 * vertices;
}

/** Decode the server's response for `count` blocks; throws ProtocolError. */
export function decodeBlocks(bytes: ArrayBuffer, vertices: number, count: number): readonly Block[] {
  const size = blockSize(vertices);
  if (bytes.byteLength !== count * size) {
    throw new ProtocolError("length of Green's functions", bytes.byteLength, `${count * size} bytes`);
  }
  return Array.from({ length: count }, (_, k) => {
    const scale = new DataView(bytes).getFloat32(k * size, true);
    if (!(scale >= 0 && scale <= 10)) throw new ProtocolError("scale of Green's functions", scale, "from 0 to 10");
    // A copy, so that a block that is dropped does not stay for the others of its response.
    return { scale, units: new Int16Array(bytes.slice(k * size + 4, (k + 1) * size)) };
  });
}

/** The load of one user on the body. */
export interface Press {
  /** Force on the hand [N]; the body gets its opposite. */
  readonly force: Vec3;
  readonly under: Pressure;
}

/**
 * The loads of all users who press.
 *
 * @param quadrature Returns the points of the resting surface; called only if somebody presses.
 */
export function pressesOf(
  users: readonly { readonly foot: Vec3; readonly normal: Vec3; readonly force: Vec3 }[],
  quadrature: () => Quadrature,
  radius: number,
): readonly Press[] {
  return users
    .filter(({ force }) => norm(force) > LEAST_FORCE)
    .map(({ foot, normal, force }) => ({ force, under: pressure(quadrature(), foot, normal, radius) }));
}

/** Vertices whose blocks the presses need, without duplicates. */
export function needed(presses: readonly Press[]): readonly number[] {
  return [...new Set(presses.flatMap(({ under }) => under.vertices))];
}

/** Displacement of all vertices, shape (n, 3) [m]; null while a block is missing. */
export function displacementOf(
  presses: readonly Press[],
  block: (vertex: number) => Block | null,
  vertices: number,
): Float32Array | null {
  const out = new Float32Array(3 * vertices);
  for (const { force, under } of presses) {
    for (const [k, vertex] of under.vertices.entries()) {
      const green = block(vertex);
      if (green === null) return null;
      add(out, green, force, -green.scale * (under.weights[k] ?? 0));
    }
  }
  return out;
}

/** out += s f . G */
function add(out: Float32Array, { units }: Block, force: Vec3, s: number): void {
  const n = out.length;
  const [fx, fy, fz] = [s * force[0], s * force[1], s * force[2]];
  for (let j = 0; j < n; j += 1) {
    const g = fx * (units[j] ?? 0) + fy * (units[n + j] ?? 0) + fz * (units[2 * n + j] ?? 0);
    out[j] = (out[j] ?? 0) + g;
  }
}
