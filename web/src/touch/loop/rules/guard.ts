/**
 * The guard: the four last rules on the force, for any law, network or device.
 *
 * `client/cohaptic_client/loop/rules/guard.py` in TypeScript, but for changes that the hand's own motion does not explain:
 * on the page they are held back by the budget alone.
 */

import { norm, scale, ZERO } from "../../../model/vec";
import type { Period } from "../period";
import { clamped, faultOf, nextFraction, release, towards } from "../safety";

/** Take the force away on a smooth ramp where something is wrong. */
export function findFault(period: Period): void {
  const { state: { safety }, now, counted, dt } = period;
  const fault = faultOf(period.asked, period.sample.velocity, dt, period.settings.limits);
  if (fault === "" && !(safety.left > 0)) return;
  period.safety = release(safety, fault, counted, now);
  period.let_go = true;
  given(period);
}

/** Clamp the force, before it fades: a force beyond the limit must not hold up a fade. */
export function clampForce(period: Period): void {
  if (!period.let_go) period.force = clamped(period.asked, period.settings.limits.max_force);
}

/** Engage the hand out of the object, and fade the force while the server is silent. */
export function fadeForce(period: Period): void {
  if (period.let_go) return;
  const { state: { safety }, settings: { limits }, silent } = period;
  const size = norm(period.asked);
  // A soft law engages no hand inside the object.
  const pressing = period.sight === null ? size : Math.max(size, period.sight.depth / period.sight.c_ii);
  const quiet = pressing < limits.engage_below ? safety.quiet + 1 : 0;
  const engaged = safety.engaged || (quiet >= limits.engage_periods && !silent);
  const up = engaged && !silent;
  const time = up ? limits.engage_time : limits.fade_time;
  const fraction = nextFraction(safety.scale, up, Math.min(size, limits.max_force), time, period.counted, period.fade_limit);
  period.force = scale(period.force, fraction);
  period.safety = { ...safety, engaged, quiet, scale: fraction, fault: engaged ? "" : safety.fault, released: ZERO, left: 0 };
}

/** Limit the change of the force: a force that vanishes jolts the hand, too. */
export function limitRate(period: Period): void {
  if (period.let_go) return;
  const { state: { safety: { force } }, settings: { limits } } = period;
  period.safety = { ...period.safety, force: towards(force, period.force, limits.max_rate * period.counted), now: period.now };
  given(period);
}

/** Fill in what the hand is given, and the fraction of what was asked for. */
function given(period: Period): void {
  const size = norm(period.asked);
  period.force = period.safety.force;
  period.given_ratio = size > 0 ? norm(period.force) / size : period.safety.scale;
}
