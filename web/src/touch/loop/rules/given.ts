/**
 * Rules on what the body gets of the force on the hand, and the account that is kept of it.
 *
 * `client/cohaptic_client/loop/rules/given.py` in TypeScript.
 */

import { times } from "../../../control/friction";
import type { Sight } from "../../../control/geometry";
import { pressedDepth } from "../../../control/law";
import type { Compliance3 } from "../../../model/body";
import type { LawName } from "../../../model/laws";
import { add, dot, norm, scale, sub, type Vec3, ZERO } from "../../../model/vec";
import type { LawFade } from "../law_fade";
import { givenEnergy, observe } from "../passivity";
import type { Period } from "../period";

/** Keep the account of the energy that the network has made, for the passivity layer. */
export function keepAccount(period: Period): void {
  const { state, sight, fade, compliance: C, safety, friction } = period;
  if (period.settings.max_damping <= 0 || state.sight === null || sight === null || fade === null) return;
  let { stored } = period.local;
  if (C !== null) stored += storedAlong(friction.force, period.law_force, C, friction.fraction);
  stored = givenEnergy(stored, period.given_ratio, safety.scale);
  const work = 0.5 * dot(add(state.safety.force, safety.force), period.moved);
  const before = state.passivity;
  const from_body = fromBody(state.sight, sight, fade, period.moved_in, C !== null);
  const owed = observe(before.owed, work, stored - before.stored, from_body, period.dt);
  period.passivity = { owed, damping: period.damping, stored };
}

/** Energy in the contact's 3x3 spring beyond that of the normal force, for a force with a part `along` the surface [J]. */
function storedAlong(along: Vec3, force: Vec3, C: Compliance3, fraction: number): number {
  // f C f / 2 for the whole force, less that for the normal force alone.
  const normal = sub(force, along);
  return (0.5 * dot(along, times(C, add(force, normal)))) / Math.max(fraction, 1e-9);
}

/** Energy from the body in a period: this client's force on it times the displacement of the surface [J]. */
function fromBody(before: Sight, now: Sight, fade: LawFade, moved_in: number, sticks: boolean): number {
  // Mean force of the period's start and end, as for the work on the hand.
  const both = scale(add(before.own_force, now.own_force), 0.5);
  const own = dot(both, now.normal);
  // The probe's own motion changes the depth too; the difference is due to the surface.
  const wayFor = (law: LawName): number => pressedDepth(law, now) - pressedDepth(law, before) - moved_in;
  let towards_hand = wayFor(fade.now.law);
  if (fade.before !== null) {
    // During a change of law each of the two laws has its fraction of the force.
    const other = wayFor(fade.before.law);
    towards_hand = other + fade.fraction * (towards_hand - other);
  }
  if (!sticks) return own * towards_hand;
  const way = sub(now.u_others, before.u_others);
  return own * towards_hand + dot(both, way) - own * dot(now.normal, way);
}

/**
 * Give the body the force of law and friction in the fraction that the hand was given, and never more than the law's.
 *
 * Damping may cancel nearly all of the law's force, or double it, and does not act on the body; while the hand's force
 * still falls to the law's force, the body gets the law's force.
 */
export function giveToBody(period: Period): void {
  const { law_force, settings: { limits: { max_force } } } = period;
  const size = norm(law_force);
  const fraction = Math.min(1, period.given_ratio);
  period.on_body = Number.isFinite(size) ? scale(law_force, size * fraction > max_force ? max_force / size : fraction) : ZERO;
}
