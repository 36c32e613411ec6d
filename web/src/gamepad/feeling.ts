/**
 * What a finger at the trigger feels of a force: resistance, and rumble of changes. Pure.
 *
 * `client/cohaptic_drivers/dualsense/feeling.py` in TypeScript.
 */

import { dot, lerp, norm, sub, type Vec3, ZERO } from "../model/vec";
import { type Effects, MOST, OFF } from "./reports";

const MEMORY = 0.02; // s; what changes faster than this is rumble
const LOUD = 0.25; // of the full force, by which a change runs the motors fully. ASSUMPTION: nobody has felt it
const QUIET = 0.08; // share of full rumble below which there is none
export const CONTACT = 0.02; // N; forces below it are no contact
const MOST_FORCE = 1e3; // N; above all that the safety layer lets pass

/** Memory of what is felt. */
export interface Feeling {
  /** The force, averaged over `MEMORY` [N]. */
  readonly slow: Vec3;
  /** Pull of the trigger at which the contact began, 0 to 255; null without one. */
  readonly start: number | null;
  /** Time of the last force [s]; null before the first. */
  readonly now: number | null;
  readonly effects: Effects;
}

export const NOTHING_FELT: Feeling = { slow: ZERO, start: null, now: null, effects: OFF };

/**
 * What is felt of a force.
 *
 * @param force On the hand [N]; one that cannot be counts as none.
 * @param pull Of the trigger at which the tip is where it is, 0 to 255.
 * @param inward Direction in which a pull moves the tip; a unit vector.
 * @param full Force that full resistance stands for [N].
 */
export function felt(before: Feeling, force: Vec3, pull: number, inward: Vec3, full: number, now: number): Feeling {
  const possible = norm(force) < MOST_FORCE ? force : ZERO; // NaN is not below it, and would stay for ever
  const against = -dot(possible, inward);
  const start = against > CONTACT ? Math.min(before.start ?? pull, pull) : null;
  const resistance = start === null ? 0 : Math.max(1, Math.min(MOST, Math.round((MOST * against) / full)));
  const passed = before.now === null ? 0 : Math.max(0, now - before.now);
  const slow = lerp(before.slow, possible, 1 - Math.exp(-passed / MEMORY));
  const loud = Math.min(1, norm(sub(possible, slow)) / (LOUD * full));
  const rumble = loud > QUIET ? Math.round(MOST * loud) : 0;
  return { slow, start, now, effects: { start: start ?? 0, resistance, rumble } };
}
