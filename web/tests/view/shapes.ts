/** Shapes whose surface is known: an octahedron, and spheres made from it. */

import { norm, row } from "../../src/model/vec";
import { place, split } from "../../src/view/body/refine";

export const OCTAHEDRON = {
  vertices: Float32Array.from([1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1]),
  faces: Uint32Array.from([0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5]),
};

/** A sphere of radius 1, `times` splits from an octahedron. */
export function sphere(times: number): { vertices: Float32Array; faces: Uint32Array } {
  let { vertices, faces }: { vertices: Float32Array; faces: Uint32Array } = OCTAHEDRON;
  for (let k = 0; k < times; k++) {
    const how = split(vertices.length / 3, faces);
    const out = new Float32Array(3 * how.coarse + 1.5 * how.edges.length);
    place(how, vertices, new Float32Array(vertices.length), out);
    for (let i = 0; i < out.length; i += 3) {
      const length = norm(row(out, i / 3));
      for (let c = i; c < i + 3; c++) out[c] = (out[c] ?? 0) / length;
    }
    vertices = out;
    faces = how.faces;
  }
  return { vertices, faces };
}
