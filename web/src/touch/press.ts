/** Laws, friction and damping at a surface in one period; half of `step.py`. */

import { type FrictionState, frictionStep, NO_FRICTION, normalShift, times } from "../control/friction";
import type { Sight } from "../control/geometry";
import { type LocalForce, NO_FORCE, pressedDepth } from "../control/law";
import type { Patch } from "../protocol/patch";
import type { Compliance3, LawName, Vec3 } from "../types";
import { add, dot, scale, sub, ZERO } from "../vec";
import { withGainsOfPatch } from "./gains";
import { type LawFade, run } from "./law_fade";
import type { LoopSettings, LoopState, Period } from "./loop";
import { dissipate } from "./passivity";
import { EXTERNAL_RATE, FADE_RATE } from "./safety";

const SOFT = 1; // N/m; what is softer gives no force that could step

/** What they make of it; the safety layer has the last word. */
export interface Pressed {
  readonly fade: LawFade | null;
  readonly local: LocalForce;
  readonly friction: FrictionState;
  readonly depth: number;
  readonly damping: number;
  /** Normal force with the damping [N]. */
  readonly damped: number;
  readonly wanted: Vec3;
  readonly on_body: Vec3;
  /** In the springs of the contact [J]. */
  readonly stored: number;
  /** What the body gave in this period [J]. */
  readonly from_body: number;
}

export const NOTHING: Pressed = {
  fade: null,
  local: NO_FORCE,
  friction: NO_FRICTION,
  depth: -Infinity,
  damping: 0,
  damped: 0,
  wanted: ZERO,
  on_body: ZERO,
  stored: 0,
  from_body: 0,
};

/** Laws, friction and damping at a surface, `before` the law in use so far. */
export function press(
  state: LoopState,
  patch: Patch,
  before: LawFade,
  period: Period,
  settings: LoopSettings,
): Pressed {
  const { sample, sight, C, dt } = period;
  const { normal } = sight;
  const told = patch.law === before.now.law ? withGainsOfPatch(state, patch, before, period, settings) : before;
  const { k_h } = told.now.gains;
  const pace = paceOf(state, k_h - before.now.gains.k_h, period, settings);
  const moved = sub(sample.position, state.probe);
  const moved_in = -dot(normal, moved);
  let { depth } = sight;
  if (state.sight !== null && state.safety.scale > 0) {
    depth = holdBack(state.depth + moved_in, depth, pace / Math.max(k_h, SOFT));
  }
  const aside = C === null ? 0 : normalShift(state.friction, normal, C);
  const [fade, local] = run(told, { ...sight, depth: depth - aside }, dt, settings.law);
  const f = local.normal_force;
  let damping = 0;
  let damped = f;
  if (state.sight !== null && settings.max_damping > 0) {
    const speed_in = -dot(normal, sample.velocity);
    [damping, damped] = dissipate(state.passivity, f, speed_in, dt, settings.max_damping);
  }
  const from_body = state.sight === null ? 0 : fromBody(state.sight, sight, fade, moved_in, C !== null);
  const common = { fade, local, depth, damping, damped, from_body };
  if (C === null) {
    const [wanted, on_body] = [scale(normal, damped), scale(normal, f)];
    return { ...common, friction: NO_FRICTION, wanted, on_body, stored: local.stored };
  }
  const share = Math.min(1, k_h * sight.c_ii);
  const friction = frictionStep(state.friction, {
    moved: sub(moved, turned(state)),
    material: sight.u_others,
    normal,
    normal_force: f,
    C,
    mu: settings.friction,
    share,
    max_stiffness: settings.max_stiffness,
    most: pace,
  });
  const on_body = add(scale(normal, f), friction.force);
  const stored = local.stored + storedAlong(friction.force, on_body, C, share);
  return { ...common, friction, wanted: add(scale(normal, damped), friction.force), on_body, stored };
}

/** By how much what others do may change the force in this period [N]. */
function paceOf(state: LoopState, gain_change: number, { dt, silent, C }: Period, settings: LoopSettings): number {
  // A late period moves the force by no more than two punctual ones.
  const counted = Math.min(dt, 2 * settings.limits.period);
  let pace = EXTERNAL_RATE * counted;
  // What a change of gain or a fade of the safety layer moves is not the surface's.
  pace -= Math.abs(gain_change) * Math.max(0, state.depth);
  if (silent || state.safety.scale < 1) pace -= FADE_RATE * counted;
  return Math.max(0, C === null ? pace : 0.5 * pace); // the other half is the friction's
}

/**
 * From the tip out to where the surface was over it in the last period [m].
 *
 * The anchor lies so deep under the tip's way along the surface. Where the surface has turned since, a part of that
 * depth is a way along it.
 */
function turned(state: LoopState): Vec3 {
  if (state.sight === null || !state.friction.touching) return ZERO;
  return scale(state.sight.normal, Math.max(0, state.depth));
}

/**
 * Depth on which the law presses: what others do to the surface moves it by `most` at most [m].
 *
 * @param depth Of the last period, and the way that the hand itself went in since [m].
 * @param target Of the probe below the surface that is shown [m].
 * @param most Way of the surface in this period [m].
 */
export function holdBack(depth: number, target: number, most: number): number {
  if (depth <= 0 && target <= 0) return target; // out of contact there is no force to move
  const start = Math.max(0, depth); // from where on there is one
  return Math.min(Math.max(target, start - most), start + most);
}

/** What the contact's 3x3 spring stores beside its normal one, of a force with a part `along` the surface [J]. */
function storedAlong(along: Vec3, force: Vec3, C: Compliance3, share: number): number {
  // f C f / 2 over all of f, less the part of the normal force alone.
  const normal = sub(force, along);
  return (0.5 * dot(along, times(C, add(force, normal)))) / Math.max(share, 1e-9);
}

/** What the body gave in a period: its own force of this client times the surface's way [J]. */
function fromBody(before: Sight, now: Sight, fade: LawFade, moved_in: number, sticks: boolean): number {
  // The mean of both ends, as for the work on the hand.
  const both = scale(add(before.own_force, now.own_force), 0.5);
  const own = dot(both, now.normal);
  // The probe's own way changes the depth too; what is left is the surface's.
  const wayFor = (law: LawName): number => pressedDepth(law, now) - pressedDepth(law, before) - moved_in;
  let towards_hand = wayFor(fade.now.law);
  if (fade.before !== null) {
    // On the way from one law to the next each has its part of the force.
    const other = wayFor(fade.before.law);
    towards_hand = other + fade.share * (towards_hand - other);
  }
  if (!sticks) return own * towards_hand;
  const way = sub(now.u_others, before.u_others);
  return own * towards_hand + dot(both, way) - own * dot(now.normal, way);
}
