/**
 * The order in which a surface is sent, and from which vertices each is foretold.
 *
 * Whoever has the resting mesh finds the same: breadth first from vertex 0, neighbours by number; a vertex is foretold
 * by the parallelogram over an edge that came before it, p + q - r (Touma and Gotsman 1998).
 */

/** Of one resting mesh of n vertices. */
export interface Traversal {
  readonly vertices: number;
  /** Vertices as they are sent, shape (n,). */
  readonly order: Uint32Array;
  /** p, q, r that foretell `order[k]` as p + q - r, shape (n, 3); n stands for zero. */
  readonly foretold: Uint32Array;
}

/** @param faces Corners, shape (m, 3); all below `n`. */
export function traversalOf(n: number, faces: Uint32Array): Traversal {
  const near = neighbours(n, faces);
  const order = breadthFirst(near);
  const place = new Uint32Array(n);
  order.forEach((v, k) => {
    place[v] = k;
  });
  const at = (v: number): number => place[v] ?? n;
  const byVertex = parallelograms(n, faces, at);
  const foretold = new Uint32Array(3 * n);
  order.forEach((v, k) => {
    foretold.set(byVertex[v] ?? single(near[v] ?? [], at, k, n), 3 * k);
  });
  return { vertices: n, order, foretold };
}

type Triple = readonly [p: number, q: number, r: number];

/** Those of each vertex across an edge, rising. */
function neighbours(n: number, faces: Uint32Array): readonly (readonly number[])[] {
  const near = Array.from({ length: n }, () => new Set<number>());
  for (let i = 0; i < faces.length; i += 1) {
    const a = faces[i] ?? 0;
    const b = faces[next(i)] ?? 0;
    near[a]?.add(b);
    near[b]?.add(a);
  }
  return near.map((set) => [...set].sort((a, b) => a - b));
}

/** The corner after corner i of a face. */
function next(i: number): number {
  return i % 3 === 2 ? i - 2 : i + 1;
}

/** All vertices; each part of the mesh begins with its lowest. */
function breadthFirst(near: readonly (readonly number[])[]): Uint32Array {
  const seen = new Uint8Array(near.length);
  const order: number[] = [];
  for (let start = 0; start < near.length; start += 1) {
    if (seen[start]) continue;
    seen[start] = 1;
    for (let k = order.push(start) - 1; k < order.length; k += 1) {
      for (const v of near[order[k] ?? 0] ?? []) {
        if (seen[v]) continue;
        seen[v] = 1;
        order.push(v);
      }
    }
  }
  return Uint32Array.from(order);
}

/** The neighbour that came first foretells alone; n without one that came before. */
function single(near: readonly number[], at: (v: number) => number, k: number, n: number): Triple {
  let first = n;
  for (const v of near) if (at(v) < k && (first === n || at(v) < at(first))) first = v;
  return [first, first, first];
}

/** By vertex, over an edge of exactly two faces; of several the one whose r came first, then p, then q. */
function parallelograms(n: number, faces: Uint32Array, at: (v: number) => number): (Triple | undefined)[] {
  // The far corner of every face at an edge; an edge by its ends, rising.
  const far = new Map<number, number[]>();
  for (let i = 0; i < faces.length; i += 1) {
    const a = faces[next(i)] ?? 0;
    const b = faces[next(next(i))] ?? 0;
    const edge = Math.min(a, b) * n + Math.max(a, b);
    const corners = far.get(edge);
    if (corners === undefined) far.set(edge, [faces[i] ?? 0]);
    else corners.push(faces[i] ?? 0);
  }
  const best = new Array<Triple | undefined>(n).fill(undefined);
  for (const [edge, [one, two, more]] of far) {
    if (one === undefined || two === undefined || more !== undefined) continue;
    const ends = [Math.floor(edge / n), edge % n].sort((a, b) => at(a) - at(b));
    const [p = n, q = n] = ends;
    for (const [v, r] of [[one, two] as const, [two, one] as const]) {
      if (Math.max(at(q), at(r)) >= at(v)) continue;
      const known = best[v];
      if (known === undefined || comesFirst([p, q, r], known, at)) best[v] = [p, q, r];
    }
  }
  return best;
}

function comesFirst(a: Triple, b: Triple, at: (v: number) => number): boolean {
  const by = [at(a[2]) - at(b[2]), at(a[0]) - at(b[0]), at(a[1]) - at(b[1])];
  return (by.find((difference) => difference !== 0) ?? 0) < 0;
}
