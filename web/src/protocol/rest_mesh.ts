/** Server to client, once: the resting surface. The inflated size is bounded before inflating. */

import type { RestMesh } from "../model/body";
import type { Vec3 } from "../model/vec";
import { checkRange, checkVector, MAX_POSITION, openFrame, ProtocolError } from "./frame";
import { inflate } from "./inflate";

const HEAD = 12;
const VERTEX = 12;
const FACE = 6;
const MAX_VERTICES = 65_535;
const MAX_FACES = 131_070;
// Deflate adds five bytes to every 16 kB that it cannot shorten.
export const MAX_MESH_BYTES = 1024 + Math.floor(((MAX_VERTICES * VERTEX + MAX_FACES * FACE) * 1001) / 1000);

/** The mesh in a frame; throws ProtocolError, whatever the bytes. */
export function decodeRestMesh(bytes: Uint8Array): RestMesh {
  const { reader } = openFrame(bytes, "rest_mesh", HEAD + 1);
  if (bytes.length > MAX_MESH_BYTES) {
    throw new ProtocolError("length of a rest mesh", bytes.length, `at most ${MAX_MESH_BYTES} bytes`);
  }
  const n = reader.u32();
  const m = reader.u32();
  checkRange("vertices of a rest mesh", n, 3, MAX_VERTICES);
  checkRange("faces of a rest mesh", m, 1, MAX_FACES);
  const raw = inflate("a rest mesh", reader.rest(), n * VERTEX + m * FACE);
  const view = new DataView(raw.buffer, raw.byteOffset, raw.byteLength);
  const vertices = new Float32Array(3 * n);
  for (let i = 0; i < n; i += 1) {
    const at = (j: number): number => view.getFloat32(VERTEX * i + 4 * j, true);
    const vertex: Vec3 = [at(0), at(1), at(2)];
    checkVector("vertex of a rest mesh", vertex, MAX_POSITION, "m");
    vertices.set(vertex, 3 * i);
  }
  const faces = new Uint32Array(3 * m);
  for (let i = 0; i < 3 * m; i += 1) {
    const corner = view.getUint16(n * VERTEX + 2 * i, true);
    checkRange("corner of a face", corner, 0, n - 1);
    faces[i] = corner;
  }
  return { vertices, faces };
}
