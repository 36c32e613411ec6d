/** The last part of a mesh patch: the free surface around the contact, vertex by vertex. */

import type { Vec3 } from "../model/vec";
import { checkRange, ProtocolError } from "./frame";
import { MAX_NEIGHBOURS, MAX_POSITION, NEIGHBOUR_SIZE, NEIGHBOURHOOD_SIZE, readNeighbourFields, readNeighbourhoodFields } from "./layout";
import { viewOf } from "./numbers";

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

/** Decode the neighbourhood from the rest of a frame; any invalid bytes throw ProtocolError. */
export function decodeNeighbourhood(rest: Uint8Array): Neighbourhood {
  const { length } = rest;
  if (length < NEIGHBOURHOOD_SIZE) {
    throw new ProtocolError("length of a neighbourhood", length, `at least ${NEIGHBOURHOOD_SIZE} bytes`);
  }
  const view = viewOf(rest);
  const { count, scale, c_scale } = readNeighbourhoodFields(view, 0);
  checkRange("vertices of a neighbourhood", count, 0, MAX_NEIGHBOURS);
  const size = NEIGHBOURHOOD_SIZE + count * NEIGHBOUR_SIZE;
  if (length !== size) throw new ProtocolError("length of a neighbourhood", length, `${size} bytes`);
  checkRange("scale of a neighbourhood", scale, 0, MAX_POSITION / 32767);
  checkRange("c_scale of a neighbourhood", c_scale, 0, MAX_POSITION / 65535);
  const near = Array.from({ length: count }, (_, k) => readNeighbourFields(view, NEIGHBOURHOOD_SIZE + k * NEIGHBOUR_SIZE));
  const indices = near.map((one) => one.indices);
  indices.forEach((index, k) => {
    const before = indices[k - 1] ?? -1;
    // A strictly rising order excludes a vertex that comes twice.
    if (index <= before) throw new ProtocolError("index of a vertex", index, `more than the one before, ${before}`);
  });
  return {
    scale,
    c_scale,
    indices,
    displacements: near.map((one) => one.displacements),
    compliances: near.map((one) => one.compliances),
  };
}
