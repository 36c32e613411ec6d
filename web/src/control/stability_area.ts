/**
 * The stable set of (K_h, I N T) of the integral model, closed and lifted, with and without delay, Fig. 8.
 *
 * Eq. (15) allows K_h beyond K_o, up to 3 K_o, where a large enough I holds what K_h alone would not: a K_h has then
 * a least I N T too.
 */

import { type ElasticObject, liftedRadius } from "./stability";

const SCAN = 48; // values of I N T among which a stable one is looked for
const BISECTIONS = 24;
const NARROWINGS = 60; // each keeps 0.618 of the interval

/** Least and largest stable I N T of one K_h [N/m]; null where there is none. */
export type Edge = readonly [least: number, largest: number] | null;

/** By eqs. (15) and (16), without delay. */
export function closedEdge(k_h: number, { k_o, b_o }: ElasticObject): Edge {
  const least = Math.max(0, k_h - k_o - 2 * b_o, 2 * k_h - 2 * k_o - 4 * b_o);
  const largest = k_h + k_o;
  return least < largest ? [least, largest] : null;
}

/** By bisection on the lifted system, for a delay in haptic samples; with whole periods the rate ratio plays no part. */
export function liftedEdge(k_h: number, body: ElasticObject, rate_ratio: number, delay_samples: number): Edge {
  const radius = (i_n_t: number): number =>
    liftedRadius({ k_h, step_gain: i_n_t / rate_ratio }, body, rate_ratio, delay_samples);
  return interval(radius, 1e-6 * body.k_o, k_h + body.k_o);
}

/**
 * The stable set as a polygon to draw: up along the largest I N T of each K_h, back along the least.
 *
 * @param delay_periods Round trip beyond the one period that computing takes, in simulation periods.
 * @returns Corners (K_h, I N T) [N/m]; empty if nothing is stable.
 */
export function stabilityArea(
  body: ElasticObject,
  delay_periods: number,
  points = 61,
): readonly (readonly [k_h: number, i_n_t: number])[] {
  const first = 1e-3 * body.k_o;
  const last = 3 * body.k_o + 4 * body.b_o;
  const up: [number, number][] = [];
  const back: [number, number][] = [];
  for (let i = 0; i < points; i += 1) {
    const k_h = first + ((last - first) * i) / (points - 1);
    const edge = liftedEdge(k_h, body, 1, delay_periods);
    if (edge === null) continue;
    up.push([k_h, edge[1]]);
    back.unshift([k_h, edge[0]]);
  }
  return [...up, ...back];
}

/** The interval in which a radius is below 1; from 0 where it begins below `first`. */
function interval(radius: (x: number) => number, first: number, last: number): Edge {
  const step = (last - first) / (SCAN - 1);
  const tried = Array.from({ length: SCAN }, (_, i) => first + i * step);
  const radii = tried.map(radius);
  let found = tried.filter((_, i) => (radii[i] ?? 1) < 1);
  if (found.length === 0) {
    // Near its corner the set is thinner than a step: go to where the radius is least.
    const best = tried[radii.indexOf(Math.min(...radii))] ?? first;
    const lowest = minimum(radius, best - step, best + step);
    if (radius(lowest) >= 1) return null;
    found = [lowest];
  }
  const low = found[0] ?? first;
  const high = found.at(-1) ?? last;
  return [low === first ? 0 : bisect(radius, low, low - step), bisect(radius, high, high + step)];
}

/** Where stability ends between a stable and an unstable I N T. */
function bisect(radius: (x: number) => number, stable: number, unstable: number): number {
  let good = stable;
  let bad = unstable;
  for (let i = 0; i < BISECTIONS; i += 1) {
    const middle = 0.5 * (good + bad);
    if (radius(middle) < 1) good = middle;
    else bad = middle;
  }
  return good;
}

/** Golden section. */
function minimum(f: (x: number) => number, from: number, to: number): number {
  const share = 0.5 * (Math.sqrt(5) - 1);
  let [a, b] = [from, to];
  let [c, d] = [b - share * (b - a), a + share * (b - a)];
  let [fc, fd] = [f(c), f(d)];
  for (let i = 0; i < NARROWINGS; i += 1) {
    if (fc < fd) {
      [b, d, fd] = [d, c, fc];
      c = b - share * (b - a);
      fc = f(c);
    } else {
      [a, c, fc] = [c, d, fd];
      d = a + share * (b - a);
      fd = f(d);
    }
  }
  return 0.5 * (a + b);
}
