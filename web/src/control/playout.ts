/**
 * When to play what comes over a link that wavers, so that its delay is constant.
 *
 * `shared/cohaptic/control/playout.py` in TypeScript, with the reasons of its constants (science 3.16).
 */

const SHARE = 0.01;
const WINDOW = 5; // s
const BEGINNING = 1.5; // s
const KEPT = 16;
const RISE = 0.25; // s/s
const FALL = 0.25; // s/s
export const LONGEST = 0.25; // s
const ANOTHER = 2; // s

/** The largest ages of the newest message in the last one to two windows, largest first, and the least one [s]. */
interface Ages {
  readonly recent: readonly number[];
  readonly count: number;
  readonly least: number;
  readonly before: readonly number[];
  readonly count_before: number;
  readonly least_before: number;
  /** End of the present window [s]. */
  readonly until: number;
}

/** The playing time of one sender's messages. */
export interface Playout {
  readonly ages: Ages;
  /** Receiver's clock less the playing time [s]. */
  readonly behind: number;
  /** Value that `behind` glides to [s]. */
  readonly wanted: number;
}

const NO_AGES: Ages = { recent: [], count: 0, least: Infinity, before: [], count_before: 0, least_before: Infinity, until: -Infinity };

/** The playout of a first message; `behind` is the receiver's clock less the message's time [s]. */
export function begun(behind: number): Playout {
  return { ages: NO_AGES, behind, wanted: behind };
}

/** Whether a message that is so old when it comes [s] is of the same clock. */
export function fits(playout: Playout, age: number): boolean {
  return Math.abs(age - playout.wanted) <= ANOTHER;
}

/** The playout after the newest message was found to be so old [s], when the next one came at time `now` [s]. */
export function measured(playout: Playout, age: number, now: number): Playout {
  const ages = withAge(playout.ages, age, now);
  const all = [...ages.recent, ...ages.before].sort((a, b) => b - a);
  const beyond = Math.trunc(SHARE * (ages.count + ages.count_before));
  const largest = all[Math.min(beyond, all.length - 1)] ?? age;
  return { ages, behind: playout.behind, wanted: Math.min(largest, lowest(ages) + LONGEST) };
}

/** The playout after a time [s], at whose end the newest message is so old; without a newer one the playing time stands. */
export function advanced(playout: Playout, dt: number, age: number): Playout {
  const gap = playout.wanted - playout.behind;
  const glided = playout.behind + Math.max(-FALL * dt, Math.min(RISE * dt, gap));
  const behind = Math.min(Math.max(glided, age), playout.wanted + LONGEST);
  return behind === playout.behind ? playout : { ...playout, behind };
}

/** What playing at constant time costs [s]. */
export function wavers(playout: Playout): number {
  return Math.max(0, playout.wanted - lowest(playout.ages));
}

function lowest(ages: Ages): number {
  return Math.min(ages.least, ages.least_before);
}

function withAge(ages: Ages, age: number, now: number): Ages {
  if (now >= ages.until) {
    return {
      recent: [age], count: 1, least: age,
      before: ages.recent, count_before: ages.count, least_before: ages.least,
      until: now + (ages.before.length > 0 ? WINDOW : BEGINNING),
    };
  }
  const least_kept = ages.recent[KEPT - 1];
  const recent =
    least_kept === undefined || age > least_kept
      ? [...ages.recent, age].sort((a, b) => b - a).slice(0, KEPT)
      : ages.recent;
  return { ...ages, recent, count: ages.count + 1, least: Math.min(ages.least, age) };
}
