/**
 * Rules on the contact: its gain, its compliance, its direction and its depth.
 *
 * Each changes the force no faster than its part of the budget allows, except for changes that the hand's own motion
 * causes. `client/cohaptic_client/loop/rules/contact.py` in TypeScript.
 */

import { wedging } from "../../../control/friction";
import { dot, norm, type Vec3 } from "../../../model/vec";
import { gainsUnder } from "../gains";
import { LAW_FADE_RATE, stiffest, withGains } from "../law_fade";
import { RAMP, SLOW } from "../passivity";
import type { Period } from "../period";
import { holdBack, slewCompliance, slewGain, slewNormal, SOFT } from "../slew";

/** Move the gain towards that of the object at the probe. */
export function moveGain(period: Period): void {
  const { state, sight, fade, settings } = period;
  const { patch, k_h_before, normal_force } = state;
  if (sight === null || fade === null || patch === null) return;
  const { k_h } = fade.now.gains;
  period.k_wanted = k_h;
  if (patch.law === fade.now.law) {
    const { k_h: newest, integral_gain } = gainsUnder(patch, sight, settings);
    period.k_wanted = k_h_before + period.fraction * (newest - k_h_before);
    let after = slewGain(k_h, period.k_wanted, period.counted, normal_force);
    const change = Math.abs(after - k_h) * Math.max(0, state.depth);
    const granted = period.budget.take(change);
    if (granted < change) after = k_h + ((after - k_h) * granted) / change;
    period.fade = withGains(fade, { k_h: after, integral_gain });
  }
  period.k_h = stiffest(period.fade ?? fade);
}

/** Set aside what fades, and the damping of a slow hand, may change of the force. */
export function reserve(period: Period): void {
  const { fade, budget, counted, silent, state } = period;
  if (fade === null) return;
  if (silent || state.safety.scale < 1) period.fade_limit = budget.take(period.fade_limit);
  if (fade.before !== null) period.law_fade_limit = budget.take(LAW_FADE_RATE * counted);
  const speed = norm(period.sample.velocity);
  const { owed, damping } = state.passivity;
  if (speed > 0 && speed <= SLOW && (owed > 0 || damping > 0)) {
    const whole = (speed * period.settings.max_damping * counted) / RAMP;
    const granted = budget.take(whole);
    if (granted < whole) period.damping_limit = granted / speed;
  }
}

/** Move the compliance of a contact with friction, and set the friction's half of the budget aside. */
export function moveCompliance(period: Period): void {
  const { state, settings, budget, counted } = period;
  if (period.sight === null || settings.friction <= 0) return;
  const half = budget.reserve(0.5);
  period.compliance = slewCompliance(state, 0.5 * half, counted, settings.simulation_period);
  // A change of the normal force by the surface comes back through the friction.
  if (period.compliance !== null) budget.reserve(wedging(settings.friction, state.normal, period.compliance, period.k_h));
}

/** Turn the force towards the surface's normal. */
export function turnForce(period: Period): void {
  const { sight, state, budget, settings, moved } = period;
  if (sight === null) return;
  period.normal = sight.normal;
  if (state.normal_force > 0 && !same(sight.normal, state.normal)) {
    period.normal = state.normal; // where the contact ends, a force that vanishes need not turn any more
    if (sight.depth > 0) {
      const force = Math.min(state.normal_force, settings.limits.max_force);
      const [normal, turned] = slewNormal(state.normal, sight.normal, moved, period.k_h, force, budget.left);
      period.normal = normal;
      budget.take(turned);
    }
  }
  period.moved_in = -dot(period.normal, moved);
  period.for_friction = 0.5 * budget.left;
}

function same(a: Vec3, b: Vec3): boolean {
  return a[0] === b[0] && a[1] === b[1] && a[2] === b[2];
}

/** Move the depth with the hand, and with the surface as the budget allows. */
export function moveDepth(period: Period): void {
  const { sight, state, budget, k_h, moved_in } = period;
  if (sight === null) return;
  // A force that the hand does not get may change at once.
  period.max_change = state.sight !== null && state.safety.scale > 0 ? budget.left : Infinity;
  period.depth = holdBack(state.depth + moved_in, sight.depth, period.max_change / Math.max(k_h, SOFT));
}
