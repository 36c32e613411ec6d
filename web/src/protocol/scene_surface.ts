/** The surface in a scene frame: the displacement of every vertex of the rest mesh, deflated. */

import { checkRange, MAX_POSITION, ProtocolError, type Reader } from "./frame";
import { inflate } from "./inflate";

const HEAD = 8;
const MAX_SCALE = MAX_POSITION / 32767;
const SMALLEST = 2 ** -126;

/** Displacement from rest of every vertex. */
export interface SceneSurface {
  /** One unit [m]. */
  readonly scale: number;
  /** In the order of the rest mesh's vertices, shape (n, 3) [scale]. */
  readonly units: Int16Array;
}

/** The surface in what is left of a frame; throws ProtocolError, whatever the bytes. */
export function readSurface(reader: Reader, vertices: number): SceneSurface {
  if (reader.left < HEAD) throw new ProtocolError("surface length", reader.left, `at least ${HEAD} bytes`);
  const scale = reader.f32();
  const length = reader.u32();
  checkRange("scale of a surface", scale, SMALLEST, MAX_SCALE);
  if (reader.left !== length) throw new ProtocolError("surface length", reader.left, `${length} bytes`);
  return { scale, units: unfold(inflate("a surface", reader.rest(), 6 * vertices), vertices) };
}

/** Byte planes to running sums, modulo 2^16: low bytes of all x, then y, then z, then the high ones. */
function unfold(raw: Uint8Array, n: number): Int16Array {
  const units = new Int16Array(3 * n);
  for (let c = 0; c < 3; c += 1) {
    const low = c * n;
    const high = (3 + c) * n;
    let sum = 0;
    for (let v = 0; v < n; v += 1) {
      const z = (raw[low + v] ?? 0) | ((raw[high + v] ?? 0) << 8);
      sum += (z >> 1) ^ -(z & 1);
      units[3 * v + c] = sum; // an Int16Array keeps it modulo 2^16
    }
  }
  return units;
}
