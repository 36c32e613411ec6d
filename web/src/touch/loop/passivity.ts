/**
 * Dissipates the energy that the server's side generates; inactive until there is such energy (science 3.4, 3.9).
 *
 * A time-domain observer and controller (Hannaford and Ryu 2002), in two-port form under delay (Ryu et al. 2010), for
 * a predictive port; `client/cohaptic_client/loop/passivity.py` has the argument. In each period
 *
 *     generated = work on the hand + increase of the energy in the local spring - energy from the body,
 *
 * where the energy from the body is own_force times the displacement of its surface. Damping in contact dissipates the
 * generated energy: never more than is left, than the device renders stably, or than the contact's own force allows, so
 * that the damping comes and goes with the contact.
 */

const FORGET = 5; // s; a hand that has been at rest for so long has dissipated the energy by itself
export const SLOW = 0.01; // m/s; a slower hand has little energy, and damping would only wait for it
export const RAMP = 0.05; // s; time from no damping to full damping
const STEP_RATE = 10; // N/s; largest rate at which a change of the damping may move the force
const MAX_DAMPING = 8; // N s/m; the campaign of `cohaptic experiment hands` is stable from 5 to 10

/** Memory of the layer. */
export interface Passivity {
  /** Energy that was generated and is not yet dissipated [J]. */
  readonly owed: number;
  /** Damping in use [N s/m]. */
  readonly damping: number;
  /** Energy in the local spring, for the fraction of its force that the hand gets [J]. */
  readonly stored: number;
}

export const NOTHING_OWED: Passivity = { owed: 0, damping: 0, stored: 0 };

/**
 * Energy that is still to be dissipated after one period [J].
 *
 * @param owed Energy to be dissipated after the last period, never negative [J].
 * @param work Work of the device on the hand in this period [J].
 * @param stored Increase of the energy in the local spring [J].
 * @param from_body Energy from the body while its surface moved [J].
 */
export function observe(owed: number, work: number, stored: number, from_body: number, dt: number): number {
  const kept = Math.max(0, 1 - dt / FORGET);
  return Math.max(0, kept * owed + work + stored - from_body);
}

/**
 * Energy in a spring of whose force the hand gets only a part [J].
 *
 * A spring that is faded to `scale` stores that fraction. A force cut to a limit goes on storing energy: the area under the
 * cut force, f d - f^2 / (2 K).
 *
 * @param stored Energy in the law's spring [J].
 * @param ratio Force that the hand gets over the law's force.
 * @param scale Share to which the safety layer has faded the law.
 */
export function givenEnergy(stored: number, ratio: number, scale: number): number {
  if (scale <= 0) return 0;
  const given = Math.min(ratio, scale); // a force that still has to fall to the law's is no spring force
  return stored * given * (2 - given / scale);
}

/**
 * Damping of one period in contact; it comes and goes within `RAMP`, so the force has no steps.
 *
 * @param before Energy to be dissipated, and damping of the last period.
 * @param force Normal force of the law [N].
 * @param speed_in Speed of the hand into the surface [m/s].
 * @param max_damping Limit of the device and of this layer [N s/m].
 * @param most Largest change of the damping, beside `RAMP` and `STEP_RATE` [N s/m].
 * @returns Damping [N s/m], and normal force on the hand, from zero to twice the law's force [N].
 */
export function dissipate(
  before: Pick<Passivity, "owed" | "damping">,
  force: number,
  speed_in: number,
  dt: number,
  max_damping: number,
  most = Infinity,
): [damping: number, damped: number] {
  if (force <= 0 || max_damping <= 0) return [0, force];
  const speed = Math.max(SLOW, Math.abs(speed_in));
  const full = dt > 0 ? Math.min(max_damping, before.owed / (speed * speed * dt)) : 0;
  const change = Math.min((max_damping * dt) / RAMP, (STEP_RATE * dt) / speed, most);
  const damping = Math.min(Math.max(full, before.damping - change), before.damping + change);
  // A hand that comes out is never pulled back in, and one that goes in meets no wall of air.
  return [damping, force + Math.min(force, Math.max(-force, damping * speed_in))];
}

/** Largest |B| that leaves a device passive, b > K T / 2 + |B| [N s/m] (Colgate). */
export function deviceDampingLimit(damping: number, stiffness: number, haptic_period: number): number {
  return Math.min(MAX_DAMPING, Math.max(0, damping - 0.5 * stiffness * haptic_period));
}
