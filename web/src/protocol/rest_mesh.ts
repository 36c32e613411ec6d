/** Server to client, once: the resting surface. The inflated size is bounded before inflating. */

import type { RestMesh } from "../model/body";
import type { Vec3 } from "../model/vec";
import { checkRange, checkVector, MAX_POSITION, openFrame, ProtocolError, type Reader } from "./frame";
import { inflate } from "./inflate";
import { unfold } from "./scene_surface";
import { traversalOf } from "./traversal";

const HEAD = 12;
const VERTEX = 12;
const PLACES = 6; // bytes of a quantised vertex
const FACE = 6;
const MAX_VERTICES = 65_535;
const MAX_FACES = 131_070;
const STEPS = 65_535; // steps of a quantised position along each axis
const ROUNDING = 1 + 1e-6; // factor on the box's far corner, for its rounding to 32 bits
// Deflate adds five bytes to every 16 kB that it cannot shorten.
export const MAX_MESH_BYTES = 1024 + Math.floor(((MAX_VERTICES * VERTEX + MAX_FACES * FACE) * 1001) / 1000);

/** Decode the mesh in a frame, exact or quantised; throws ProtocolError for any invalid bytes. */
export function decodeRestMesh(bytes: Uint8Array): RestMesh {
  const { flags, reader } = openFrame(bytes, "rest_mesh", HEAD + 1);
  if (bytes.length > MAX_MESH_BYTES) {
    throw new ProtocolError("length of a rest mesh", bytes.length, `at most ${MAX_MESH_BYTES} bytes`);
  }
  checkRange("flags of a rest mesh", flags, 0, 1);
  const n = reader.u32();
  const m = reader.u32();
  checkRange("vertices of a rest mesh", n, 3, MAX_VERTICES);
  checkRange("faces of a rest mesh", m, 1, MAX_FACES);
  return flags === 1 ? quantised(reader, n, m) : exact(reader, n, m);
}

function exact(reader: Reader, n: number, m: number): RestMesh {
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

/** Read vertices of 16 bits per axis of the bounding box, predicted like the surface of a scene. */
function quantised(reader: Reader, n: number, m: number): RestMesh {
  if (reader.left <= 24) throw new ProtocolError("length of a quantised mesh", HEAD + reader.left, `more than ${HEAD + 24} bytes`);
  const low = reader.vec();
  const unit = reader.vec();
  for (const [k, from] of low.entries()) {
    const size = STEPS * (unit[k] ?? NaN);
    checkRange("low end of a mesh's box", from, -MAX_POSITION, MAX_POSITION);
    checkRange("size of a mesh's box", size, 0, (MAX_POSITION - from) * ROUNDING + 1e-6);
  }
  const raw = inflate("a rest mesh", reader.rest(), m * FACE + n * PLACES);
  const faces = cornersOf(raw.subarray(0, m * FACE), n, m);
  const places = new Uint16Array(unfold(raw.subarray(m * FACE), traversalOf(n, faces)));
  const vertices = new Float32Array(3 * n);
  for (let k = 0; k < 3; k += 1) {
    const from = low[k] ?? 0;
    const by = unit[k] ?? 0;
    for (let i = k; i < 3 * n; i += 3) vertices[i] = from + by * (places[i] ?? 0);
  }
  return { vertices, faces };
}

/** Corners from byte planes: the low bytes of all first corners, of all second and all third ones, then the high bytes likewise. */
function cornersOf(planes: Uint8Array, n: number, m: number): Uint32Array {
  const faces = new Uint32Array(3 * m);
  for (let c = 0; c < 3; c += 1) {
    for (let f = 0; f < m; f += 1) {
      const corner = (planes[c * m + f] ?? 0) | ((planes[(3 + c) * m + f] ?? 0) << 8);
      if (corner >= n) checkRange("corner of a face", corner, 0, n - 1);
      faces[3 * f + c] = corner;
    }
  }
  for (let f = 0; f < 3 * m; f += 3) {
    const [a, b, c] = [faces[f], faces[f + 1], faces[f + 2]];
    // The order of the vertices is defined for triangles only.
    if (a === b || b === c || c === a) throw new ProtocolError("face of a quantised mesh", `${a}, ${b}, ${c}`, "three corners");
  }
  return faces;
}
