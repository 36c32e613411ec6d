/**
 * The paper's proportional-integral local model, section 5, with the hygiene of 5.1.
 *
 * L(z) = K_h + T I / (z - 1), eq. (12). The integrand is e - theta, with the threshold of eq. (17) or (18); when
 * contact ends the integral's force goes to zero linearly over a few simulation periods. How (18) is read:
 * `shared/cohaptic/control/proportional_integral.py`.
 */

/** A probe that comes out more slowly is at rest [m/s]: between two thresholds the integral would hunt. */
const AT_REST_SPEED = 5e-3;

/** Steady-state error that the integral tolerates, eqs. (17) and (18). */
export interface Thresholds {
  /** theta while the probe goes in or rests [m]. */
  readonly entering: number;
  /** Largest theta while it comes out [m]. */
  readonly leaving: number;
  /** Force of the integral from which `leaving` holds in full; below it theta is proportional to that force [N]. */
  readonly full_force: number;
}

export const DEFAULT_THRESHOLDS: Thresholds = { entering: 0.2e-3, leaving: 1e-3, full_force: 1 };

/** Memory of the integral. */
export interface IntegralState {
  /** Force of the integral [N]. */
  readonly force: number;
  /** Rate at which the integral's force goes to zero out of contact [N/s]. */
  readonly ramp: number;
  /** Depth of the probe in the last period [m]. */
  readonly depth: number;
}

export const AT_REST: IntegralState = { force: 0, ramp: 0, depth: 0 };

/** theta of eq. (17) or (18) [m]. */
export function integrationThreshold(
  state: IntegralState,
  depth: number,
  { entering, leaving, full_force }: Thresholds,
  dt: number,
): number {
  if (depth <= 0) return 0;
  if (depth >= state.depth - AT_REST_SPEED * dt) return entering;
  return leaving * (state.force >= full_force ? 1 : state.force / full_force);
}

/** Settings of the integral. */
export interface IntegralSettings {
  readonly thresholds: Thresholds;
  /** Time from the full force of the integral to none when contact ends [s]. */
  readonly release_time: number;
  /** Upper limit of the integral's force [N]. */
  readonly max_force: number;
}

/**
 * One period of L(z) = K_h + T I / (z - 1), eqs. (12), (17), (18).
 *
 * @param depth e, the depth of the probe below the surface as the simulation returned it [m].
 * @returns Next state, and force on the hand along the outward normal [N].
 */
export function proportionalIntegralStep(
  state: IntegralState,
  depth: number,
  k_h: number,
  integral_gain: number,
  settings: IntegralSettings,
  dt: number,
): [state: IntegralState, force: number] {
  if (depth <= 0) {
    const force = Math.max(0, state.force - state.ramp * dt);
    return [{ force, ramp: state.ramp, depth }, force];
  }
  const theta = integrationThreshold(state, depth, settings.thresholds, dt);
  const grown = state.force + integral_gain * dt * (depth - theta);
  const force = Math.min(Math.max(grown, 0), settings.max_force);
  return [{ force, ramp: force / settings.release_time, depth }, k_h * depth + force];
}
