/** Laws, friction and damping at a surface in one period; a part of `client/cohaptic_client/loop/step.py`. */

import { believedShift, type FrictionState, frictionStep, NO_FRICTION, normalShift, times, wedging } from "../../control/friction";
import type { Sight } from "../../control/geometry";
import { type LocalForce, NO_FORCE, pressedDepth } from "../../control/law";
import type { Compliance3 } from "../../model/body";
import type { LawName } from "../../model/laws";
import { add, dot, scale, sub, type Vec3, ZERO } from "../../model/vec";
import type { Patch } from "../../protocol/patch";
import { withGainsOfPatch } from "./gains";
import { LAW_FADE_RATE, type LawFade, run, stiffest } from "./law_fade";
import { dissipate } from "./passivity";
import { EXTERNAL_RATE, FADE_RATE } from "./safety";
import { holdBack, slewCompliance, slewNormal, SOFT } from "./slew";
import type { LoopSettings, LoopState, Period } from "./state";

/** Result of laws, friction and damping, before the safety layer. */
export interface ContactForce {
  readonly fade: LawFade | null;
  readonly local: LocalForce;
  readonly friction: FrictionState;
  readonly depth: number;
  /** Direction in which the law pressed. */
  readonly normal: Vec3;
  /** Compliance of the contact for its friction; null without friction. */
  readonly compliance: Compliance3 | null;
  readonly damping: number;
  /** Normal force with the damping [N]. */
  readonly damped: number;
  readonly requested: Vec3;
  readonly on_body: Vec3;
  /** Energy in the springs of the contact [J]. */
  readonly stored: number;
  /** Energy from the body in this period [J]. */
  readonly from_body: number;
}

export const NO_CONTACT: ContactForce = {
  fade: null,
  local: NO_FORCE,
  friction: NO_FRICTION,
  depth: -Infinity,
  normal: [0, 0, 1],
  compliance: null,
  damping: 0,
  damped: 0,
  requested: ZERO,
  on_body: ZERO,
  stored: 0,
  from_body: 0,
};

/** Compute laws, friction and damping at a surface; `before` is the law in use so far. */
export function contactForce(
  state: LoopState,
  patch: Patch,
  before: LawFade,
  period: Period,
  settings: LoopSettings,
): ContactForce {
  const { sample, sight, counted } = period;
  const updated = patch.law === before.now.law ? withGainsOfPatch(state, patch, before, period, settings) : before;
  const k_h = stiffest(updated);
  let pace = paceOf(state, updated.now.gains.k_h - before.now.gains.k_h, updated, period);
  let C: Compliance3 | null = null;
  if (settings.friction > 0) {
    pace *= 0.5; // the other half of the allowed change is for the friction
    C = slewCompliance(state, 0.5 * pace, counted, settings.simulation_period);
    // A change of the normal force by the surface comes back through the friction.
    if (C !== null) pace *= 1 - wedging(settings.friction, state.normal, C, k_h);
  }
  const moved = sub(sample.position, state.probe);
  let { normal } = sight;
  if (state.normal_force > 0 && !same(normal, state.normal)) {
    const force = Math.min(state.normal_force, settings.limits.max_force);
    // A force that vanishes need not turn any more.
    if (sight.depth <= 0) ({ normal } = state);
    else [normal, pace] = slewNormal(state.normal, normal, moved, k_h, force, pace);
  }
  const moved_in = -dot(normal, moved);
  // A force that the hand does not get may change at once.
  const most = state.sight !== null && state.safety.scale > 0 ? pace : Infinity;
  const depth = holdBack(state.depth + moved_in, sight.depth, most / Math.max(k_h, SOFT));
  const aside = C === null ? 0 : believedShift(normal, C, k_h) * normalShift(state.friction, normal, C);
  const [fade, local] = run(updated, { ...sight, depth: depth - aside }, counted, settings.law, moved_in, most);
  const f = local.normal_force;
  let damping = 0;
  let damped = f;
  if (state.sight !== null && settings.max_damping > 0) {
    const speed_in = -dot(normal, sample.velocity);
    [damping, damped] = dissipate(state.passivity, f, speed_in, counted, settings.max_damping);
  }
  const from_body = state.sight === null ? 0 : fromBody(state.sight, sight, fade, moved_in, C !== null);
  const common = { fade, local, depth, normal, compliance: C, damping, damped, from_body };
  if (C === null) {
    const [requested, on_body] = [scale(normal, damped), scale(normal, f)];
    return { ...common, friction: NO_FRICTION, requested, on_body, stored: local.stored };
  }
  const share = Math.min(1, updated.now.gains.k_h * sight.c_ii);
  const friction = frictionStep(state.friction, {
    moved: sub(moved, turned(state)),
    material: sight.u_others,
    normal,
    normal_force: f,
    C,
    mu: settings.friction,
    share,
    max_stiffness: settings.max_stiffness,
    most: 0.5 * pace,
  });
  const on_body = add(scale(normal, f), friction.force);
  const stored = local.stored + storedAlong(friction.force, on_body, C, friction.share);
  return { ...common, friction, requested: add(scale(normal, damped), friction.force), on_body, stored };
}

/** Largest change of the force by the others in this period [N]. */
function paceOf(state: LoopState, gain_change: number, fade: LawFade, { counted, silent }: Period): number {
  let pace = EXTERNAL_RATE * counted;
  // Changes of gain and fades of the safety layer use up a part of the allowed change.
  pace -= Math.abs(gain_change) * Math.max(0, state.depth);
  if (silent || state.safety.scale < 1) pace -= FADE_RATE * counted;
  if (fade.before !== null) pace -= LAW_FADE_RATE * counted;
  return Math.max(0, pace);
}

function same(a: Vec3, b: Vec3): boolean {
  return a[0] === b[0] && a[1] === b[1] && a[2] === b[2];
}

/**
 * Vector from the tip out to the law's surface over it in the last period [m].
 *
 * The anchor lies below the tip's way along the surface by this depth. If the surface has turned since, a part of that
 * depth is a way along the surface.
 */
function turned(state: LoopState): Vec3 {
  if (state.sight === null || !state.friction.touching) return ZERO;
  return scale(state.normal, Math.max(0, state.depth));
}

/** Energy in the contact's 3x3 spring beyond that of the normal force, for a force with a part `along` the surface [J]. */
function storedAlong(along: Vec3, force: Vec3, C: Compliance3, share: number): number {
  // f C f / 2 for the whole force, less that for the normal force alone.
  const normal = sub(force, along);
  return (0.5 * dot(along, times(C, add(force, normal)))) / Math.max(share, 1e-9);
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
    // During a change of law each of the two laws has its share of the force.
    const other = wayFor(fade.before.law);
    towards_hand = other + fade.share * (towards_hand - other);
  }
  if (!sticks) return own * towards_hand;
  const way = sub(now.u_others, before.u_others);
  return own * towards_hand + dot(both, way) - own * dot(now.normal, way);
}
