/**
 * A finer surface for display, smooth through the received vertices.
 *
 * Each edge gets a new vertex in its middle, on the cubic that leaves both ends along their tangent planes. It lies above
 * the facet, as a circle's arc lies above its chord. The received vertices are not moved.
 */

import { vertexNormals } from "./normals";

/** Split of a mesh: each edge gets a new vertex, and each face becomes four. */
export interface Split {
  /** Number of vertices before the split. */
  readonly coarse: number;
  /** Ends of each split edge, shape (e, 2). */
  readonly edges: Uint32Array;
  /** Faces after the split, shape (4 m, 3). */
  readonly faces: Uint32Array;
}

export function split(vertices: number, faces: Uint32Array): Split {
  const middles = new Map<number, number>();
  const edges: number[] = [];
  const middle = (a: number, b: number): number => {
    const key = a < b ? a * vertices + b : b * vertices + a;
    let index = middles.get(key);
    if (index === undefined) {
      index = vertices + edges.length / 2;
      middles.set(key, index);
      edges.push(a, b);
    }
    return index;
  };
  const out = new Uint32Array(4 * faces.length);
  for (let f = 0, o = 0; f + 2 < faces.length; f += 3, o += 12) {
    const a = faces[f] ?? 0;
    const b = faces[f + 1] ?? 0;
    const c = faces[f + 2] ?? 0;
    const ab = middle(a, b);
    const bc = middle(b, c);
    const ca = middle(c, a);
    out.set([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], o);
  }
  return { coarse: vertices, edges: Uint32Array.from(edges), faces: out };
}

/** Largest difference of two tangent planes in a bend; a larger one is an edge of the body. */
const CREASE = 0.6;

/**
 * Place the vertices of a split.
 *
 * @param positions Vertices before the split, shape (n, 3) [m].
 * @param normals Unit normals, shape (n, 3).
 * @param out Vertices after the split, shape (n + e, 3), overwritten.
 */
export function place(how: Split, positions: Float32Array, normals: Float32Array, out: Float32Array): void {
  out.set(positions);
  const p = positions;
  const n = normals;
  for (let e = 0, o = 3 * how.coarse; e + 1 < how.edges.length; e += 2, o += 3) {
    const a = 3 * (how.edges[e] ?? 0);
    const b = 3 * (how.edges[e + 1] ?? 0);
    let rise = 0; // (b - a) . n_a
    let fall = 0; // (b - a) . n_b
    let cosine = 0;
    for (let k = 0; k < 3; k++) {
      const way = (p[b + k] ?? 0) - (p[a + k] ?? 0);
      rise += way * (n[a + k] ?? 0);
      fall += way * (n[b + k] ?? 0);
      cosine += (n[a + k] ?? 0) * (n[b + k] ?? 0);
    }
    const bend = 0.125 * Math.min(1, Math.max(0, (cosine - CREASE) / (0.85 - CREASE)));
    for (let k = 0; k < 3; k++) {
      const lift = fall * (n[b + k] ?? 0) - rise * (n[a + k] ?? 0);
      out[o + k] = 0.5 * ((p[a + k] ?? 0) + (p[b + k] ?? 0)) + bend * lift;
    }
  }
}

/** Splits of one mesh, with memory that is used again for every frame. */
export class Refiner {
  readonly faces: Uint32Array;
  /** Fine vertices and their normals after the last call of `run`, shape (N, 3). */
  positions: Float32Array;
  normals: Float32Array;

  private readonly levels: readonly { how: Split; faces: Uint32Array; normals: Float32Array; out: Float32Array }[];

  /** @param most Largest number of vertices of the finest level. */
  constructor(vertices: number, faces: Uint32Array, most = 16_000) {
    const levels: Refiner["levels"][number][] = [];
    let n = vertices;
    let f = faces;
    // A closed triangle mesh has about three edges for each vertex.
    while (4 * n <= most && levels.length < 3) {
      const how = split(n, f);
      const next = n + how.edges.length / 2;
      levels.push({ how, faces: f, normals: new Float32Array(3 * n), out: new Float32Array(3 * next) });
      n = next;
      f = how.faces;
    }
    this.levels = levels;
    this.faces = f;
    this.positions = new Float32Array(3 * n);
    this.normals = new Float32Array(3 * n);
  }

  /** @param coarse Received vertices, shape (n, 3) [m]. */
  run(coarse: Float32Array): void {
    let p = coarse;
    for (const level of this.levels) {
      vertexNormals(p, level.faces, level.normals);
      place(level.how, p, level.normals, level.out);
      p = level.out;
    }
    this.positions = p;
    vertexNormals(p, this.faces, this.normals);
  }
}
