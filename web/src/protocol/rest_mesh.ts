/** Server to client, once: the resting surface. The inflated size is bounded before inflating. */

import type { RestMesh } from "../model/body";
import { checkRange, checkVector, openFrame, ProtocolError } from "./frame";
import { inflate } from "./inflate";
import {
  BOX_SIZE,
  FACE_SIZE,
  MAX_FACES,
  MAX_MESH_BYTES,
  MAX_POSITION,
  MAX_VERTICES,
  MESH_STEPS,
  readBoxFields,
  readRestMeshFields,
  REST_MESH_SIZE,
  VERTEX_SIZE,
} from "./layout";
import { getVec, viewOf } from "./numbers";
import { unfold } from "./scene_surface";
import { traversalOf } from "./traversal";

const PLACES = 6; // bytes of a quantised vertex
const ROUNDING = 1 + 1e-6; // factor on the box's far corner, for its rounding to 32 bits

/** Decode the mesh in a frame, exact or quantised; throws ProtocolError for any invalid bytes. */
export function decodeRestMesh(bytes: Uint8Array): RestMesh {
  const { flags, view } = openFrame(bytes, "rest_mesh", REST_MESH_SIZE + 1);
  if (bytes.length > MAX_MESH_BYTES) {
    throw new ProtocolError("length of a rest mesh", bytes.length, `at most ${MAX_MESH_BYTES} bytes`);
  }
  checkRange("flags of a rest mesh", flags, 0, 1);
  const { vertices: n, faces: m } = readRestMeshFields(view);
  checkRange("vertices of a rest mesh", n, 3, MAX_VERTICES);
  checkRange("faces of a rest mesh", m, 1, MAX_FACES);
  return flags === 1 ? quantised(bytes, view, n, m) : exact(bytes, n, m);
}

function exact(bytes: Uint8Array, n: number, m: number): RestMesh {
  const raw = inflate("a rest mesh", bytes.subarray(REST_MESH_SIZE), n * VERTEX_SIZE + m * FACE_SIZE);
  const view = viewOf(raw);
  const vertices = new Float32Array(3 * n);
  for (let i = 0; i < n; i += 1) {
    const vertex = getVec(view, VERTEX_SIZE * i);
    checkVector("vertex of a rest mesh", vertex, MAX_POSITION, "m");
    vertices.set(vertex, 3 * i);
  }
  const faces = new Uint32Array(3 * m);
  for (let i = 0; i < 3 * m; i += 1) {
    const corner = view.getUint16(n * VERTEX_SIZE + 2 * i, true);
    checkRange("corner of a face", corner, 0, n - 1);
    faces[i] = corner;
  }
  return { vertices, faces };
}

/** Read vertices of 16 bits per axis of the bounding box, predicted like the surface of a scene. */
function quantised(bytes: Uint8Array, view: DataView, n: number, m: number): RestMesh {
  const start = REST_MESH_SIZE + BOX_SIZE;
  if (bytes.length <= start) throw new ProtocolError("length of a quantised mesh", bytes.length, `more than ${start} bytes`);
  const { low, unit } = readBoxFields(view, REST_MESH_SIZE);
  for (const [k, from] of low.entries()) {
    const size = MESH_STEPS * (unit[k] ?? NaN);
    checkRange("low end of a mesh's box", from, -MAX_POSITION, MAX_POSITION);
    checkRange("size of a mesh's box", size, 0, (MAX_POSITION - from) * ROUNDING + 1e-6);
  }
  const raw = inflate("a rest mesh", bytes.subarray(start), m * FACE_SIZE + n * PLACES);
  const faces = cornersOf(raw.subarray(0, m * FACE_SIZE), n, m);
  const places = new Uint16Array(unfold(raw.subarray(m * FACE_SIZE), traversalOf(n, faces)));
  const vertices = new Float32Array(places).map((z, i) => (low[i % 3] ?? 0) + (unit[i % 3] ?? 0) * z);
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
