/**
 * The stable set of (K_h, I N T) of Fig. 8, and whether given gains are in it.
 *
 * Without delay the set is eq. (15). With d further simulation periods the loop's characteristic
 * polynomial is z^(d+1) (z - 1) + kappa (z - 1) + int, kappa = K_h / K_o, int = I N T / K_o
 * (docs/science.md 3.1); all its roots must lie inside the unit circle. The recursion of Schur and Cohn answers
 * that in microseconds. `shared/cohaptic/control/stability` finds the same set from the eigenvalues of the lifted
 * system; the tests compare the two by `tests/vectors/stability.json`.
 */

export interface Gains {
  /** K_h / K_o. */
  readonly kappa: number;
  /** I N T / K_o. */
  readonly int: number;
}

/** Whether gains with K_h, I > 0 fulfil eq. (15). */
export function isStable15(gains: Gains): boolean {
  return Math.abs(gains.int - gains.kappa) < 1 && gains.int - 2 * gains.kappa > -2;
}

/**
 * Whether the integral law settles with `delay` whole further simulation periods round the loop.
 * Without an integral it is the proportional law: K_h < K_o at any delay, eq. (8).
 */
export function isStable(gains: Gains, delay: number): boolean {
  const { kappa, int } = gains;
  if (!(kappa >= 0) || !(int >= 0)) return false;
  if (int === 0) return kappa < 1;
  const d = Math.max(0, Math.round(delay));
  const p = new Array<number>(d + 3).fill(0);
  p[0] = 1;
  p[1] = -1;
  p[d + 1] = (p[d + 1] ?? 0) + kappa;
  p[d + 2] = (p[d + 2] ?? 0) - kappa + int;
  return rootsInside(p);
}

/**
 * Whether all roots of a polynomial lie inside the unit circle: Schur and Cohn's recursion, which
 * takes one degree away at a time.
 *
 * @param coefficients Coefficients of the polynomial, that of z^n first.
 */
export function rootsInside(coefficients: readonly number[]): boolean {
  let p = [...coefficients];
  while (p.length > 1) {
    const lead = p[0] ?? 0;
    const end = p[p.length - 1] ?? 0;
    if (!(Math.abs(end) < Math.abs(lead))) return false;
    const n = p.length - 1;
    const q: number[] = [];
    for (let k = 0; k < n; k++) q.push(lead * (p[k] ?? 0) - end * (p[n - k] ?? 0));
    // Only signs and ratios count; without this the numbers run out of range at long delays.
    const size = Math.max(...q.map(Math.abs));
    p = size > 0 ? q.map((x) => x / size) : q;
  }
  return true;
}

/**
 * Outline of the set to draw, from the least and the largest I N T over K_o for each kappa.
 *
 * @returns Points (kappa, int): up along the largest, back along the least.
 */
export function stableOutline(delay: number, points = 60): [number, number][] {
  const up: [number, number][] = [];
  const back: [number, number][] = [];
  const widest = delay < 1 ? 3 : 1.2;
  for (let i = 0; i <= points; i++) {
    const kappa = 1e-3 + (widest - 2e-3) * (i / points);
    const edges = stableEdges(kappa, delay);
    if (edges === null) continue;
    up.push([kappa, edges[1]]);
    back.push([kappa, edges[0]]);
  }
  return [...up, ...back.reverse()];
}

/** Least and largest stable I N T / K_o at a kappa, with `delay` whole further periods; null where there is none. */
export function stableEdges(kappa: number, delay: number): [number, number] | null {
  return delay < 1 ? closedEdges(kappa) : searchedEdges(kappa, delay);
}

function closedEdges(kappa: number): [number, number] | null {
  const low = Math.max(0, kappa - 1, 2 * kappa - 2);
  return low < kappa + 1 ? [low, kappa + 1] : null;
}

/** Edges by scanning and bisection: for each K_h the stable gains of a delayed loop are one interval of I N T. */
function searchedEdges(kappa: number, delay: number): [number, number] | null {
  const steps = 160;
  const stable = (int: number): boolean => isStable({ kappa, int }, delay);
  const top = kappa + 1;
  let first = -1;
  let last = -1;
  for (let i = 0; i <= steps; i++) {
    if (!stable(Math.max(1e-4, (top * i) / steps))) continue;
    if (first < 0) first = i;
    last = i;
  }
  if (first < 0) return null;
  const at = (i: number): number => (top * i) / steps;
  const low = first === 0 ? 0 : halve(stable, at(first), at(first - 1));
  return [low, halve(stable, Math.max(1e-4, at(last)), at(last + 1))];
}

function halve(stable: (x: number) => boolean, good: number, bad: number): number {
  for (let i = 0; i < 18; i++) {
    const middle = 0.5 * (good + bad);
    if (stable(middle)) good = middle;
    else bad = middle;
  }
  return good;
}
