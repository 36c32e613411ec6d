/**
 * The local models that a client may run, and the one function that runs them; `control/law.py` in TypeScript.
 *
 * A law computes the normal force on the hand from the surface at the probe; its memory is an argument and a result.
 * It has no clock, no log and no clamp: limits are applied once, last, by `touch/loop/safety.ts`.
 */

import { answersOwnDent, type LawName } from "../model/laws";
import { dot } from "../model/vec";
import type { Sight } from "./geometry";
import { predictiveForce } from "./predictive";
import { proportionalForce, proportionalStiffness } from "./proportional";
import {
  DEFAULT_THRESHOLDS,
  type IntegralSettings,
  type IntegralState,
  proportionalIntegralStep,
} from "./proportional_integral";

/** The gains that the server chose for a client's law. */
export interface Gains {
  /** K_h [N/m]. */
  readonly k_h: number;
  /** I of the law's integral; 0 for none [N/(m s)]. */
  readonly integral_gain: number;
}

export type LawSettings = IntegralSettings;

export const DEFAULT_LAW_SETTINGS: LawSettings = {
  thresholds: DEFAULT_THRESHOLDS,
  release_time: 0.1,
  max_force: 10,
};

/** The result of a law. */
export interface LocalForce {
  /** Force on the hand along the surface's normal, never negative [N]. */
  readonly normal_force: number;
  /** Part of that force that the contacts of the others cause [N]. */
  readonly felt_from_others: number;
  /** Indentation of the surface under the probe, own force included [m]. */
  readonly indentation: number;
  /** Energy in the law's spring; the part of the force that is not a spring force stores none [J]. */
  readonly stored: number;
}

export const NO_FORCE: LocalForce = { normal_force: 0, felt_from_others: 0, indentation: 0, stored: 0 };

/** Depth on which a law acts [m]: the paper's laws act on the surface as the server returned it, own dent included. */
export function pressedDepth(law: LawName, sight: Sight): number {
  return answersOwnDent(law) ? sight.depth - sight.c_ii * dot(sight.own_force, sight.normal) : sight.depth;
}

/**
 * Force of `law` for a probe at a local surface, free of this client's own force.
 *
 * @param moved_in Way of the hand into the surface since the last period [m].
 * @param most Largest change of a force with an integral that this way does not explain [N].
 */
export function localForce(
  law: LawName,
  memory: IntegralState,
  sight: Sight,
  gains: Gains,
  dt: number,
  settings: LawSettings,
  moved_in: number,
  most: number,
): [memory: IntegralState, force: LocalForce] {
  const d_free = sight.depth;
  const { k_h, integral_gain } = gains;
  // Depth that the probe would have if nobody else touched the body.
  const d_alone = Math.max(0, d_free - dot(sight.u_others, sight.normal));
  const said = (f: number, stiffness: number, stored: number): LocalForce => ({
    normal_force: f,
    felt_from_others: f - stiffness * d_alone,
    indentation: sight.c_ii * f,
    stored,
  });
  if (law === "predictive") {
    const f = predictiveForce(d_free, k_h);
    return [memory, said(f, k_h, 0.5 * f * d_free)];
  }
  const d = pressedDepth(law, sight);
  const stored = d > 0 ? 0.5 * k_h * d * d : 0;
  const stiffness = proportionalStiffness(k_h, sight.c_ii);
  if (law === "proportional") return [memory, said(proportionalForce(d, k_h), stiffness, stored)];
  law satisfies "pi"; // the compiler refuses a law without a force
  const [after, f] = proportionalIntegralStep(memory, d, k_h, integral_gain, settings, dt, moved_in, most);
  // When the integral has settled, the surface follows the probe, and the hand feels K_o.
  return [after, said(f, d_free > 0 ? f / d_free : stiffness, stored)];
}
