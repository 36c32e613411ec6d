/**
 * The surface in a scene frame: the displacement of every vertex of the rest mesh, deflated.
 *
 * The frame holds whole numbers with a common scale, each minus its prediction from neighbours (`traversal.ts`).
 */

import { checkRange, ProtocolError } from "./frame";
import { inflate } from "./inflate";
import { MAX_POSITION, readSurfaceFields, SURFACE_SIZE } from "./layout";
import { viewOf } from "./numbers";
import type { Traversal } from "./traversal";

const MAX_SCALE = MAX_POSITION / 32767;
const SMALLEST = 2 ** -126;

/** Displacement of every vertex from its resting position. */
export interface SceneSurface {
  /** One unit [m]. */
  readonly scale: number;
  /** Displacements in the order of the rest mesh's vertices, shape (n, 3) [scale]. */
  readonly units: Int16Array;
}

/** Decode the surface from the rest of a frame; any invalid bytes throw ProtocolError. */
export function decodeSurface(rest: Uint8Array, traversal: Traversal): SceneSurface {
  if (rest.length < SURFACE_SIZE) throw new ProtocolError("surface length", rest.length, `at least ${SURFACE_SIZE} bytes`);
  const { scale, length } = readSurfaceFields(viewOf(rest), 0);
  const stream = rest.subarray(SURFACE_SIZE);
  checkRange("scale of a surface", scale, SMALLEST, MAX_SCALE);
  if (stream.length !== length) throw new ProtocolError("surface length", stream.length, `${length} bytes`);
  // A stream that is longer than the rest mesh needs is refused.
  return { scale, units: unfold(inflate("a surface", stream, 6 * traversal.vertices), traversal) };
}

/** Convert byte planes to units, modulo 2^16: low bytes of all x, then y, then z, then the high bytes. */
export function unfold(raw: Uint8Array, { vertices: n, order, foretold }: Traversal): Int16Array {
  const units = new Int16Array(3 * (n + 1)); // the last one stands for zero
  for (let c = 0; c < 3; c += 1) {
    const low = c * n;
    const high = (3 + c) * n;
    const unit = (k: number): number => units[3 * (foretold[k] ?? n) + c] ?? 0;
    for (let k = 0; k < n; k += 1) {
      const z = (raw[low + k] ?? 0) | ((raw[high + k] ?? 0) << 8);
      const step = (z >> 1) ^ -(z & 1);
      units[3 * (order[k] ?? n) + c] = unit(3 * k) + unit(3 * k + 1) - unit(3 * k + 2) + step;
    }
  }
  return units.subarray(0, 3 * n);
}
