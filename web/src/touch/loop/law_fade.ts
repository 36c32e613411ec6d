/**
 * The law in use, and the transition to another law without a step in the force.
 *
 * When patches come for another law, both laws run, and the force moves from one to the other: within `FADE_TIME`, and
 * by no more than `SHARE_RATE` times itself and `LAW_FADE_RATE` per second. `client/cohaptic_client/loop/law_fade.py` in
 * TypeScript.
 */

import type { Sight } from "../../control/geometry";
import { type Gains, type LawSettings, type LocalForce, localForce, pressedDepth } from "../../control/law";
import { AT_REST, type IntegralState } from "../../control/proportional_integral";
import { integrates, type LawName } from "../../model/laws";
import { EXTERNAL_RATE } from "./safety";

const FADE_TIME = 0.3; // s
const SHARE_RATE = 10; // 1/s; 1 % of the force per millisecond
export const LAW_FADE_RATE = 0.5 * EXTERNAL_RATE; // N/s; the rest of `EXTERNAL_RATE` is for the surface
const LEAST = 0.05; // N; a smaller force counts as this, because steps of a fraction of it would never end

/** One law with its memory. */
export interface Running {
  readonly law: LawName;
  /** Gains in use. */
  readonly gains: Gains;
  /** Memory of the law's integral. */
  readonly memory: IntegralState;
}

/** The law in use and the one that it replaces. */
export interface LawFade {
  readonly now: Running;
  /** Law that `now` replaces; null when the change is over. */
  readonly before: Running | null;
  /** Share of `now` in the force, 0 to 1. */
  readonly fraction: number;
}

/** Largest K_h by which the force may follow a motion: that of both laws during a change [N/m]. */
export function stiffest(fade: LawFade): number {
  return Math.max(fade.now.gains.k_h, fade.before?.gains.k_h ?? 0);
}

/** A fade that is over, with one law. */
export function settled(law: LawName, gains: Gains): LawFade {
  return { now: { law, gains, memory: AT_REST }, before: null, fraction: 1 };
}

/**
 * Begin to change to `law`; the present law runs on beside it until the change is over.
 *
 * During a change, a change back begins at once, but a third law waits for the end: patches that ask for it keep coming.
 * The integral of the new law begins with the value that gives the force of the old law.
 *
 * @param force Normal force now [N].
 * @param sight Present surface at the probe; null without one.
 */
export function switchLaw(fade: LawFade, law: LawName, gains: Gains, force: number, sight: Sight | null): LawFade {
  if (law === fade.now.law) return fade;
  if (fade.before === null) {
    let memory = AT_REST;
    if (sight !== null && integrates(law)) {
      const depth = pressedDepth(law, sight);
      memory = { force: Math.max(0, force - gains.k_h * depth), ramp: 0, depth };
    }
    return { now: { law, gains, memory }, before: fade.now, fraction: 0 };
  }
  if (law === fade.before.law) return { now: fade.before, before: fade.now, fraction: 1 - fade.fraction };
  return fade;
}

/** Other gains for the law in use. */
export function withGains(fade: LawFade, gains: Gains): LawFade {
  return { ...fade, now: { ...fade.now, gains } };
}

/** One period of the law in use, and of the one that it replaces; `moved_in` and `most` as in `localForce`, `fade_limit` the largest change of the force by the transition [N]. */
export function run(
  fade: LawFade,
  sight: Sight,
  dt: number,
  settings: LawSettings,
  moved_in: number,
  most: number,
  fade_limit = Infinity,
): [fade: LawFade, force: LocalForce] {
  const advance = ({ law, memory, gains }: Running): [IntegralState, LocalForce] =>
    localForce(law, memory, sight, gains, dt, settings, moved_in, most);
  const [memory, force] = advance(fade.now);
  const now = { ...fade.now, memory };
  const old = fade.before;
  if (old === null) return [{ now, before: null, fraction: 1 }, force];
  const [oldMemory, oldForce] = advance(old);
  const gap = Math.abs(force.normal_force - oldForce.normal_force);
  const present = mix(oldForce, force, fade.fraction).normal_force;
  let step = dt / FADE_TIME;
  const rate = Math.min(LAW_FADE_RATE, SHARE_RATE * Math.max(present, LEAST));
  if (gap > 0) step = Math.min(step, Math.min(rate * dt, fade_limit) / gap);
  const fraction = Math.min(1, fade.fraction + step);
  if (fraction >= 1) return [{ now, before: null, fraction: 1 }, force];
  return [{ now, before: { ...old, memory: oldMemory }, fraction }, mix(oldForce, force, fraction)];
}

function mix(a: LocalForce, b: LocalForce, s: number): LocalForce {
  return {
    normal_force: a.normal_force + s * (b.normal_force - a.normal_force),
    felt_from_others: a.felt_from_others + s * (b.felt_from_others - a.felt_from_others),
    indentation: a.indentation + s * (b.indentation - a.indentation),
    stored: a.stored + s * (b.stored - a.stored),
  };
}
