/**
 * Pure conversion of a force to what the hand feels: resistance of the trigger, and rumble for changes.
 *
 * `client/cohaptic_drivers/dualsense/feeling.py` in TypeScript.
 */

import { dot, lerp, norm, sub, type Vec3, ZERO } from "../model/vec";
import { type Effects, MOST, OFF } from "./reports";

const MEMORY = 0.02; // s; changes of the force that are faster than this become rumble
const LOUD = 0.25; // share of the full force; a change by it runs the motors fully. ASSUMPTION: nobody has felt it
const QUIET = 0.08; // share of full rumble; a weaker rumble is set to zero
export const CONTACT = 0.02; // N; forces below it are no contact
const MOST_FORCE = 1e3; // N; larger than any force that the safety layer lets pass

/** Effects for the last force, and the memory that the next conversion needs. */
export interface Feeling {
  /** The force, averaged over `MEMORY` [N]. */
  readonly slow: Vec3;
  /** Least pull of the trigger since the contact began, 0 to 255; null without contact. */
  readonly start: number | null;
  /** Time of the last force [s]; null before the first. */
  readonly now: number | null;
  readonly effects: Effects;
}

export const NOTHING_FELT: Feeling = { slow: ZERO, start: null, now: null, effects: OFF };

/**
 * Convert a force to effects of the pad; returns them with the new memory.
 *
 * @param force Force on the hand [N]; one that is impossibly large or NaN counts as zero.
 * @param pull Pull of the trigger that corresponds to the tip's press, 0 to 255.
 * @param inward Direction in which a pull moves the tip; a unit vector.
 * @param full Force that full resistance represents [N].
 */
export function felt(before: Feeling, force: Vec3, pull: number, inward: Vec3, full: number, now: number): Feeling {
  const possible = norm(force) < MOST_FORCE ? force : ZERO; // NaN is not below it, and would stay in the memory for ever
  const against = -dot(possible, inward);
  const start = against > CONTACT ? Math.min(before.start ?? pull, pull) : null;
  const resistance = start === null ? 0 : Math.max(1, Math.min(MOST, Math.round((MOST * against) / full)));
  const passed = before.now === null ? 0 : Math.max(0, now - before.now);
  const slow = lerp(before.slow, possible, 1 - Math.exp(-passed / MEMORY));
  const loud = Math.min(1, norm(sub(possible, slow)) / (LOUD * full));
  const rumble = loud > QUIET ? Math.round(MOST * loud) : 0;
  return { slow, start, now, effects: { start: start ?? 0, resistance, rumble } };
}
