/**
 * The order in which the vertices of a surface are sent, and the vertices from which each is predicted.
 *
 * Server and page compute the same order from the resting mesh: breadth first from vertex 0, neighbours by number. A vertex
 * is predicted by the parallelogram over an edge that came before it, p + q - r (Touma and Gotsman 1998).
 */

/** Order and predictions for one resting mesh of n vertices. */
export interface Traversal {
  readonly vertices: number;
  /** Vertices in the order in which they are sent, shape (n,). */
  readonly order: Uint32Array;
  /** Vertices p, q, r that predict `order[k]` as p + q - r, shape (n, 3); the number n stands for zero. */
  readonly foretold: Uint32Array;
}

/** @param faces Corners of the faces, shape (m, 3); all below `n`. */
export function traversalOf(n: number, faces: Uint32Array): Traversal {
  const edges = edgesOf(n, faces);
  const near = neighbours(n, edges);
  const order = breadthFirst(n, near);
  const place = new Uint32Array(n + 1).fill(n);
  order.forEach((v, k) => {
    place[v] = k;
  });
  const foretold = parallelograms(n, faces, edges, place);
  single(foretold, order, near, place);
  return { vertices: n, order, foretold };
}

/** The edge opposite to each corner, sorted by its ends, so that corners with the same edge are side by side. */
interface Edges {
  /** The edge's end with the lower number, shape (3 m,), by corner; `high` is the other end. */
  readonly low: Uint32Array;
  readonly high: Uint32Array;
  /** Corners, sorted by the lower end of their edge, then by the higher end. */
  readonly sorted: Uint32Array;
}

function edgesOf(n: number, faces: Uint32Array): Edges {
  const low = new Uint32Array(faces.length);
  const high = new Uint32Array(faces.length);
  for (let i = 0; i < faces.length; i += 1) {
    const a = faces[next(i)] ?? 0;
    const b = faces[next(next(i))] ?? 0;
    low[i] = a < b ? a : b;
    high[i] = a < b ? b : a;
  }
  const all = faces.map((_, i) => i);
  return { low, high, sorted: sortedBy(low, sortedBy(high, all, n), n) };
}

/** The corner after corner i of a face. */
function next(i: number): number {
  return i % 3 === 2 ? i - 2 : i + 1;
}

/** Sort items by key, stably, in a time that no mesh can make long. */
function sortedBy(key: Uint32Array, items: Uint32Array, n: number): Uint32Array {
  const start = starts(n, key);
  const out = new Uint32Array(items.length);
  for (let i = 0; i < items.length; i += 1) {
    const item = items[i] ?? 0;
    const k = key[item] ?? 0;
    const at = start[k] ?? 0;
    out[at] = item;
    start[k] = at + 1;
  }
  return out;
}

/** Index at which the entries of each number below `n` begin when they are sorted, shape (n + 1,). */
function starts(n: number, ...keys: readonly Uint32Array[]): Uint32Array {
  const start = new Uint32Array(n + 1);
  for (const key of keys) {
    for (let i = 0; i < key.length; i += 1) {
      const k = key[i] ?? 0;
      start[k + 1] = (start[k + 1] ?? 0) + 1;
    }
  }
  for (let k = 0; k < n; k += 1) start[k + 1] = (start[k + 1] ?? 0) + (start[k] ?? 0);
  return start;
}

/** Neighbours of vertex v from `begin[v]` to below `end[v]`, rising. */
interface Near {
  readonly begin: Uint32Array;
  readonly end: Uint32Array;
  readonly of: Uint32Array;
}

function neighbours(n: number, { low, high, sorted }: Edges): Near {
  const begin = starts(n, low, high);
  const end = begin.slice();
  const of = new Uint32Array(2 * sorted.length);
  // Neighbours of lower numbers come first, in rising order because of the sorting, then those of higher numbers likewise.
  for (const [from, to] of [[low, high], [high, low]] as const) {
    for (let s = 0; s < sorted.length; s += 1) {
      const i = sorted[s] ?? 0;
      const v = to[i] ?? 0;
      const w = from[i] ?? 0;
      const at = end[v] ?? 0;
      if (at > (begin[v] ?? 0) && of[at - 1] === w) continue;
      of[at] = w;
      end[v] = at + 1;
    }
  }
  return { begin, end, of };
}

/** All vertices, breadth first; each connected part of the mesh begins with its lowest vertex. */
function breadthFirst(n: number, { begin, end, of }: Near): Uint32Array {
  const seen = new Uint8Array(n);
  const order = new Uint32Array(n);
  let known = 0;
  for (let start = 0, k = 0; start < n; start += 1) {
    if (seen[start]) continue;
    seen[start] = 1;
    order[known++] = start;
    for (; k < known; k += 1) {
      const v = order[k] ?? 0;
      for (let i = begin[v] ?? 0; i < (end[v] ?? 0); i += 1) {
        const w = of[i] ?? 0;
        if (seen[w]) continue;
        seen[w] = 1;
        order[known++] = w;
      }
    }
  }
  return order;
}

/** Predict by parallelograms over edges of exactly two faces; of several, by the one whose r came first, then p, then q. */
function parallelograms(n: number, faces: Uint32Array, { low, high, sorted }: Edges, place: Uint32Array): Uint32Array {
  const foretold = new Uint32Array(3 * n).fill(n);
  const at = (v: number): number => place[v] ?? n;
  const offer = (p: number, q: number, r: number, v: number): void => {
    if (at(q) >= at(v) || at(r) >= at(v)) return;
    const k = 3 * at(v);
    const before =
      at(r) - at(foretold[k + 2] ?? n) || at(p) - at(foretold[k] ?? n) || at(q) - at(foretold[k + 1] ?? n);
    if (before >= 0) return;
    foretold[k] = p;
    foretold[k + 1] = q;
    foretold[k + 2] = r;
  };
  for (let s = 0, e = 0; s < sorted.length; s = e) {
    const i = sorted[s] ?? 0;
    const a = low[i] ?? 0;
    const b = high[i] ?? 0;
    for (e = s + 1; e < sorted.length && low[sorted[e] ?? 0] === a && high[sorted[e] ?? 0] === b; ) e += 1;
    if (e !== s + 2) continue;
    const one = faces[i] ?? 0;
    const two = faces[sorted[s + 1] ?? 0] ?? 0;
    const p = at(a) < at(b) ? a : b;
    const q = p === a ? b : a;
    offer(p, q, two, one);
    offer(p, q, one, two);
  }
  return foretold;
}

/** Predict each vertex without a parallelogram by its neighbour that came first; by n (zero) if no neighbour came before. */
function single(foretold: Uint32Array, order: Uint32Array, { begin, end, of }: Near, place: Uint32Array): void {
  const n = order.length;
  for (let k = 0; k < n; k += 1) {
    if (foretold[3 * k] !== n) continue;
    const v = order[k] ?? 0;
    let first = n;
    for (let i = begin[v] ?? 0; i < (end[v] ?? 0); i += 1) {
      const w = of[i] ?? 0;
      const came = place[w] ?? n;
      if (came < k && came < (place[first] ?? n)) first = w;
    }
    foretold.fill(first, 3 * k, 3 * k + 3);
  }
}
