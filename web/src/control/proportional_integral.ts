/**
 * The paper's proportional-integral local model, section 5, with the hygiene of 5.1.
 *
 * L(z) = K_h + T I / (z - 1), eq. (12). The integrand is e - theta, with the threshold of eq. (17) or (18); when
 * contact ends the integral's force goes to zero linearly over a few simulation periods. How (18) is read, and why the
 * integral keeps the limit of the whole force's change: `shared/cohaptic/control/laws/pi.py`.
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
 * @param moved_in Way of the hand into the surface since the last period [m].
 * @param most Largest change of the force that this way does not explain [N].
 * @returns Next state, and force on the hand along the outward normal [N].
 */
export function proportionalIntegralStep(
  state: IntegralState,
  depth: number,
  k_h: number,
  integral_gain: number,
  settings: IntegralSettings,
  dt: number,
  moved_in: number,
  most: number,
): [state: IntegralState, force: number] {
  // Eq. (17) or (18).
  const { entering, leaving, full_force } = settings.thresholds;
  const rests = depth >= state.depth - AT_REST_SPEED * dt;
  const theta = rests ? entering : leaving * (state.force >= full_force ? 1 : state.force / full_force);
  const grown = depth > 0 ? integral_gain * dt * (depth - theta) : -state.ramp * dt;
  const spring = k_h * Math.max(0, depth);
  const before = k_h * Math.max(0, state.depth) + state.force - spring;
  const own = k_h * moved_in;
  const slewed = Math.min(
    Math.max(state.force + grown, before + Math.min(0, own) - most),
    before + Math.max(0, own) + most,
  );
  const force = Math.min(Math.max(slewed, 0), settings.max_force);
  // Also a force that the integral took from a surface that left the hand goes to zero in time.
  const ramp = Math.max(depth > 0 ? 0 : state.ramp, force / settings.release_time);
  return [{ force, ramp, depth }, spring + force];
}
