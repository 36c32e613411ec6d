/** The last part of a mesh patch: the free surface around the contact, vertex by vertex. */

import type { Vec3 } from "../model/vec";
import { checkRange, MAX_POSITION, ProtocolError, type Reader } from "./frame";

const HEAD = 10;
const ITEM = 10;
export const MAX_NEAR = 97;

/** k vertices of the resting mesh and their present displacements, in rising order. */
export interface Neighbourhood {
  /** One unit of `displacements` [m]. */
  readonly scale: number;
  /** One unit of `compliances` [m/N]. */
  readonly c_scale: number;
  /** Indices of the vertices in the resting mesh, rising, shape (k,). */
  readonly indices: readonly number[];
  /** Displacements without this client's own force, shape (k, 3) [scale]. */
  readonly displacements: readonly Vec3[];
  /** Compliance of a contact centred at each vertex, along its normal, shape (k,) [c_scale]. */
  readonly compliances: readonly number[];
}

/** Read the neighbourhood from the rest of a frame; any invalid bytes throw ProtocolError. */
export function readNeighbourhood(reader: Reader): Neighbourhood {
  const length = reader.left;
  if (length < HEAD) {
    throw new ProtocolError("length of a neighbourhood", length, `at least ${HEAD} bytes`);
  }
  const count = reader.u16();
  const scale = reader.f32();
  const c_scale = reader.f32();
  checkRange("vertices of a neighbourhood", count, 0, MAX_NEAR);
  const size = HEAD + count * ITEM;
  if (length !== size) throw new ProtocolError("length of a neighbourhood", length, `${size} bytes`);
  checkRange("scale of a neighbourhood", scale, 0, MAX_POSITION / 32767);
  checkRange("c_scale of a neighbourhood", c_scale, 0, MAX_POSITION / 65535);
  const indices: number[] = [];
  const displacements: Vec3[] = [];
  const compliances: number[] = [];
  let before = -1;
  for (let k = 0; k < count; k += 1) {
    const index = reader.u16();
    // A strictly rising order excludes a vertex that comes twice.
    if (index <= before) {
      throw new ProtocolError("index of a vertex", index, `more than the one before, ${before}`);
    }
    before = index;
    indices.push(index);
    displacements.push([reader.i16(), reader.i16(), reader.i16()]);
    compliances.push(reader.u16());
  }
  return { scale, c_scale, indices, displacements, compliances };
}
