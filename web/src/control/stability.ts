/**
 * When the loop between a local model and a slow, distant simulation is stable; `control/stability.py` in TypeScript.
 *
 * The closed conditions (8), (10), (15), (16), and the lifted system of eqs. (1)-(6) with delay in haptic samples, of
 * the two local models of the paper on its one-dimensional object.
 */

import { type Matrix, spectralRadius } from "./eigenvalues";

/** The paper's object, eqs. (6) and (9). */
export interface ElasticObject {
  /** Local stiffness [N/m]. */
  readonly k_o: number;
  /** Local damping over the simulation period [N/m]. */
  readonly b_o: number;
}

/** L(z) = K_h + T I / (z - 1), eq. (12), at the haptic rate. */
export interface LocalModel {
  readonly k_h: number;
  /** T I [N/m]; null for a model without the integral. */
  readonly step_gain: number | null;
}

/** Eq. (8), with damping (10): without delay; without damping for every delay (science 3.1). */
export function proportionalIsStable(k_h: number, { k_o, b_o }: ElasticObject): boolean {
  return k_h < k_o + 2 * b_o;
}

/** Eq. (15), with damping (16), both without delay; `i_n_t` is I N T [N/m]. For K_h, I > 0. */
export function integralIsStable(k_h: number, i_n_t: number, { k_o, b_o }: ElasticObject): boolean {
  return Math.abs(i_n_t - k_h + b_o) < k_o + b_o && i_n_t - 2 * k_h > -2 * k_o - 4 * b_o;
}

/**
 * Spectral radius of the loop over one simulation period; stable iff < 1.
 *
 * @param rate_ratio N, haptic samples per simulation period.
 * @param delay_samples Round trip beyond the one period that computing takes, in haptic samples.
 */
export function liftedRadius(
  local: LocalModel,
  body: ElasticObject,
  rate_ratio: number,
  delay_samples: number,
): number {
  const whole = Math.floor(delay_samples / rate_ratio);
  const part = delay_samples % rate_ratio;
  const n = local.step_gain === null ? 0 : 1;
  const slots = whole + 1 + (part > 0 ? 1 : 0);
  const size = n + 1 + slots;
  // State: integral, object, positions on their way (the newest first).
  const row = (): number[] => new Array<number>(size).fill(0);
  const matrix: Matrix = [];
  const oldest = size - 1;
  const newer = n + 1 + whole;
  const force = row();
  if (local.step_gain !== null) {
    // Seen in a period: an older position for the first `part` samples, then the newer one.
    const integral = row();
    integral[0] = 1;
    integral[newer] = (integral[newer] ?? 0) - (rate_ratio - part) * local.step_gain;
    integral[oldest] = (integral[oldest] ?? 0) - part * local.step_gain;
    matrix.push(integral);
    force[0] = 1;
  }
  const first = part > 0 ? oldest : newer;
  force[first] = (force[first] ?? 0) - local.k_h;
  // Position at tick k+1 from force at tick k: (K_o + B_o) x+ = f + B_o x.
  const position = force.map((f) => f / (body.k_o + body.b_o));
  position[n] = (position[n] ?? 0) + body.b_o / (body.k_o + body.b_o);
  matrix.push(position, [...position]);
  for (let k = 1; k < slots; k += 1) {
    const later = row();
    later[n + k] = 1;
    matrix.push(later);
  }
  return spectralRadius(matrix);
}
