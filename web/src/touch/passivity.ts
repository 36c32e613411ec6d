/**
 * Takes out the energy that delay makes; silent until some is made (science 3.4).
 *
 * A time-domain observer and controller (Hannaford and Ryu 2002), in two-port form under delay (Ryu et al. 2010), for
 * a predictive port; `client/cohaptic_client/passivity.py` has the argument. What the network made in a period is
 * (f - own_force) dx, with dx the movement towards the hand of the surface that the law presses on. It is taken out
 * by damping in contact, never more than is owed, never more than the device renders stably.
 */

const FORGET = 5; // s; a hand that rested so long has swallowed by itself what it was given
const SLOW = 0.01; // m/s; a slower hand has little energy, and damping would only wait for it
const RAMP = 0.05; // s; from no damping to all of it
const MAX_DAMPING = 8; // N s/m; the campaign of `cohaptic experiment hands` is stable from 5 to 10

/** Memory of the layer. */
export interface Passivity {
  /** Energy that was made and not taken out yet [J]. */
  readonly owed: number;
  /** In use [N s/m]. */
  readonly damping: number;
}

export const NOTHING_OWED: Passivity = { owed: 0, damping: 0 };

/**
 * Energy that is still to be taken out, after one period [J].
 *
 * @param force Normal force of the law now [N].
 * @param own_force Of this client in the surface that is shown [N].
 * @param surface_moved By how much it came towards the hand in this period [m].
 */
export function observe(owed: number, force: number, own_force: number, surface_moved: number, dt: number): number {
  const kept = Math.max(0, 1 - dt / FORGET);
  return Math.max(0, kept * owed + (force - own_force) * surface_moved);
}

/**
 * Damping of one period in contact; it comes and goes within `RAMP`, so the force has no steps.
 *
 * @param before Energy to be taken out, and damping of the last period.
 * @param force Normal force of the law [N].
 * @param speed_in Of the hand into the surface [m/s].
 * @param max_damping Limit, of the device and of this layer [N s/m].
 * @returns What is left, and the normal force on the hand [N].
 */
export function dissipate(
  before: Passivity,
  force: number,
  speed_in: number,
  dt: number,
  max_damping: number,
): [after: Passivity, damped: number] {
  if (force <= 0 || max_damping <= 0) return [{ owed: before.owed, damping: 0 }, force];
  const speed = Math.max(SLOW, Math.abs(speed_in));
  const wanted = dt > 0 ? Math.min(max_damping, before.owed / (speed * speed * dt)) : 0;
  const change = (max_damping * dt) / RAMP;
  const damping = Math.min(Math.max(wanted, before.damping - change), before.damping + change);
  // A hand that comes out is never pulled back in.
  const damped = Math.max(0, force + damping * speed_in);
  const owed = Math.max(0, before.owed - (damped - force) * speed_in * dt);
  return [{ owed, damping }, damped];
}

/** Largest |B| that leaves a device passive, b > K T / 2 + |B| [N s/m] (Colgate). */
export function deviceDampingLimit(damping: number, stiffness: number, haptic_period: number): number {
  return Math.min(MAX_DAMPING, Math.max(0, damping - 0.5 * stiffness * haptic_period));
}
