/**
 * Largest modulus of an eigenvalue of a small real matrix.
 *
 * Brought to Hessenberg form by reflections, then the QR algorithm with two shifts at once
 * (Francis 1961; Golub and Van Loan, Matrix Computations, 7.5).
 */

export type Matrix = number[][];

const EPS = 2 ** -52;
const MOST_SWEEPS = 60; // for one eigenvalue; two or three are usual

/** 0 for an empty matrix; NaN if the iteration does not converge. */
export function spectralRadius(matrix: readonly (readonly number[])[]): number {
  const h = matrix.map((row) => [...row]);
  hessenberg(h);
  let largest = 0;
  for (const [re, im] of eigenvalues(h)) {
    const size = Math.hypot(re, im);
    if (!(size <= largest)) largest = size;
  }
  return largest;
}

function at(h: Matrix, i: number, j: number): number {
  return h[i]?.[j] ?? 0;
}

function put(h: Matrix, i: number, j: number, value: number): void {
  const row = h[i];
  if (row !== undefined) row[j] = value;
}

/** Similar, and zero below the first subdiagonal; Householder reflections from both sides. */
function hessenberg(h: Matrix): void {
  const n = h.length;
  for (let k = 0; k < n - 2; k += 1) {
    const v = Array.from({ length: n }, (_, i) => (i > k ? at(h, i, k) : 0));
    reflect(h, v, k + 1, n);
  }
}

/** h <- P h P with P = I - 2 v v' / v'v that takes v to a multiple of the unit vector of `first`. */
function reflect(h: Matrix, v: number[], first: number, n: number): void {
  const size = Math.hypot(...v);
  if (size === 0) return;
  const head = v[first] ?? 0;
  v[first] = head + (head >= 0 ? size : -size);
  const square = v.reduce((sum, x) => sum + x * x, 0);
  for (let j = 0; j < n; j += 1) {
    let s = 0;
    for (let i = first; i < n; i += 1) s += (v[i] ?? 0) * at(h, i, j);
    s *= 2 / square;
    for (let i = first; i < n; i += 1) put(h, i, j, at(h, i, j) - s * (v[i] ?? 0));
  }
  for (let i = 0; i < n; i += 1) {
    let s = 0;
    for (let j = first; j < n; j += 1) s += at(h, i, j) * (v[j] ?? 0);
    s *= 2 / square;
    for (let j = first; j < n; j += 1) put(h, i, j, at(h, i, j) - s * (v[j] ?? 0));
  }
}

/** Of a Hessenberg matrix, which is used up. */
function* eigenvalues(h: Matrix): Generator<[re: number, im: number]> {
  let last = h.length - 1;
  let sweeps = 0;
  while (last >= 0) {
    let low = last;
    while (low > 0 && !negligible(h, low)) low -= 1;
    if (low === last) {
      yield [at(h, last, last), 0];
      last -= 1;
      sweeps = 0;
    } else if (low === last - 1) {
      yield* pair(h, low);
      last -= 2;
      sweeps = 0;
    } else if (sweeps === MOST_SWEEPS) {
      yield [NaN, NaN];
      return;
    } else {
      sweeps += 1;
      // An exceptional shift now and then breaks the cycles of permutations.
      sweep(h, low, last, sweeps % 10 === 0);
    }
  }
}

function negligible(h: Matrix, i: number): boolean {
  const around = Math.abs(at(h, i - 1, i - 1)) + Math.abs(at(h, i, i));
  return Math.abs(at(h, i, i - 1)) <= EPS * (around > 0 ? around : 1e-300);
}

/** Both eigenvalues of the block of two rows from `i`. */
function* pair(h: Matrix, i: number): Generator<[number, number]> {
  const [a, b, c, d] = [at(h, i, i), at(h, i, i + 1), at(h, i + 1, i), at(h, i + 1, i + 1)];
  const half = 0.5 * (a - d);
  const under = half * half + b * c;
  const middle = 0.5 * (a + d);
  if (under < 0) {
    yield [middle, Math.sqrt(-under)];
    yield [middle, -Math.sqrt(-under)];
    return;
  }
  const root = half >= 0 ? half + Math.sqrt(under) : half - Math.sqrt(under);
  yield [d + root, 0];
  yield [root === 0 ? d : d - (b * c) / root, 0];
}

/** One double-shift QR sweep over rows `low` to `last`. */
function sweep(h: Matrix, low: number, last: number, exceptional: boolean): void {
  const size = Math.abs(at(h, last, last - 1)) + Math.abs(at(h, last - 1, last - 2));
  const a = at(h, last - 1, last - 1);
  const d = at(h, last, last);
  const sum = exceptional ? 1.5 * size : a + d;
  const product = exceptional ? size * size : a * d - at(h, last - 1, last) * at(h, last, last - 1);
  const [h00, h10] = [at(h, low, low), at(h, low + 1, low)];
  // First column of (H - s1)(H - s2).
  let v = [
    h00 * h00 + at(h, low, low + 1) * h10 - sum * h00 + product,
    h10 * (h00 + at(h, low + 1, low + 1) - sum),
    h10 * at(h, low + 2, low + 1),
  ];
  for (let k = low; k < last; k += 1) {
    const rows = Math.min(3, last - k + 1);
    chase(h, v.slice(0, rows), k, low, last);
    v = [at(h, k + 1, k), at(h, k + 2, k), k + 3 <= last ? at(h, k + 3, k) : 0];
  }
}

/** Reflect rows and columns k to k + 2 so that `v` loses all but its first entry. */
function chase(h: Matrix, v: number[], k: number, low: number, last: number): void {
  const size = Math.hypot(...v);
  if (size === 0) return;
  const head = v[0] ?? 0;
  v[0] = head + (head >= 0 ? size : -size);
  const square = v.reduce((sum, x) => sum + x * x, 0);
  for (let j = Math.max(low, k - 1); j <= last; j += 1) {
    const s = (2 / square) * v.reduce((sum, x, i) => sum + x * at(h, k + i, j), 0);
    v.forEach((x, i) => {
      put(h, k + i, j, at(h, k + i, j) - s * x);
    });
  }
  for (let i = low; i <= Math.min(last, k + 3); i += 1) {
    const s = (2 / square) * v.reduce((sum, x, j) => sum + x * at(h, i, k + j), 0);
    v.forEach((x, j) => {
      put(h, i, k + j, at(h, i, k + j) - s * x);
    });
  }
  for (let i = k + 1; i < k + v.length && k > low; i += 1) put(h, i, k - 1, 0);
}
