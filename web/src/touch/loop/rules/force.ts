/** Rules on the force of the contact: law, damping and friction. `client/cohaptic_client/loop/rules/force.py` in TypeScript. */

import { believedShift, frictionStep, normalShift } from "../../../control/friction";
import { add, dot, scale, sub } from "../../../model/vec";
import { run } from "../law_fade";
import { dissipate } from "../passivity";
import type { Period } from "../period";

/** Run the law: from the depth, less the friction's shift of the contact, to the normal force. */
export function runLaw(period: Period): void {
  const { sight, fade, normal, compliance: C } = period;
  if (sight === null || fade === null) return;
  const aside = C === null ? 0 : believedShift(normal, C, period.k_h) * normalShift(period.state.friction, normal, C);
  period.law_depth = period.depth - aside;
  const surface = { ...sight, depth: period.law_depth };
  [period.fade, period.local] = run(fade, surface, period.counted, period.settings.law, period.moved_in, period.max_change, period.law_fade_limit);
  period.damped_force = period.local.normal_force;
  period.asked = period.law_force = scale(normal, period.local.normal_force);
}

/** Damp the hand while energy is owed that nobody spent. */
export function damp(period: Period): void {
  const { state, normal, settings: { max_damping } } = period;
  if (state.sight === null || max_damping <= 0) return;
  const speed_in = -dot(normal, period.sample.velocity);
  const force = period.local.normal_force;
  [period.damping, period.damped_force] = dissipate(state.passivity, force, speed_in, period.counted, max_damping, period.damping_limit);
  period.asked = scale(normal, period.damped_force);
}

/** Add friction along the surface, from the tip's own motion and the material's. */
export function addFriction(period: Period): void {
  const { compliance: C, sight, fade, state, settings, normal } = period;
  if (C === null || sight === null || fade === null) return;
  let { moved } = period;
  if (state.sight !== null && state.friction.touching) {
    // The anchor lies below the tip's way along the surface by the depth. If the surface has turned since, a part of that
    // depth is a way along the surface.
    moved = sub(moved, scale(state.normal, Math.max(0, state.depth)));
  }
  period.friction = frictionStep(state.friction, {
    moved,
    material: sight.u_others,
    normal,
    normal_force: period.local.normal_force,
    C,
    mu: settings.friction,
    fraction: Math.min(1, fade.now.gains.k_h * sight.c_ii),
    max_stiffness: settings.max_stiffness,
    max_change: period.for_friction,
  });
  period.asked = add(period.asked, period.friction.force);
  period.law_force = add(period.law_force, period.friction.force);
}
