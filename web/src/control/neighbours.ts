/**
 * Simulated rooms of the campaign that resemble this room, and their outcomes.
 *
 * The campaign (`experiments/neighbours.py`) has run random rooms under each law. For each room the table has six
 * whole numbers: the longest loop [ms], the coupling m in hundredths, the lag [ms], whether it was unstable, the swing
 * of its last seconds [% of the largest force], and the largest error of a steady force in thousandths.
 */

import type { RoomLag } from "../model/body";
import { answersOwnDent } from "../model/laws";
import type { UserState } from "../model/scene";

/** Source of the gains: a law that takes all hands into account, or the paper's rule, which considers one contact alone. */
export type Rule = "predictive" | "pi" | "proportional" | "alone";

/** Key by which a room is looked up; whole numbers, as in the table. */
export interface RoomFacts {
  readonly rule: Rule;
  readonly hands: number;
  /** The longest loop [ms]. */
  readonly delay: number;
  /** m, in hundredths. */
  readonly coupling: number;
  /** Lag of the room [ms]. */
  readonly lag: number;
}

/** For each rule, for 1, 2, ... hands: the numbers of all rooms one after the other. */
export type Table = Readonly<Record<Rule, readonly (readonly number[])[]>>;

type Place = Pick<RoomFacts, "delay" | "coupling" | "lag">;

export interface Neighbours {
  /** Rooms of the same rule with as many hands. */
  readonly rooms: number;
  /** Number of these rooms within reach in loop, coupling and lag. */
  readonly like: number;
  readonly stable: number;
  /** Largest swing of the rooms within reach that were not stable [% of the largest force]. */
  readonly swing: number;
  /** Largest error of a steady force in the rooms within reach that were stable [thousandths]. */
  readonly error: number;
  /** The nearest room; null if there is no room of this rule with as many hands. */
  readonly nearest: Place | null;
}

/** Reason why the campaign has no rooms like this one at all. */
export type Foreign = "too many" | "mixed laws" | "own gains" | "friction" | "soft device";

const COLUMNS = 6;
/** Largest difference between rooms that count as alike: `least`, or `share` of the value, whichever is more. */
export const REACH: Readonly<Record<keyof Place, { readonly least: number; readonly share: number }>> = {
  delay: { least: 20, share: 0.25 },
  coupling: { least: 10, share: 0.2 },
  lag: { least: 20, share: 0.4 },
};
// K_h that the server chooses for the paper's laws over the stiffness with all hands (`gains.py`), and the tolerance for
// rounding and for a hand that has just moved.
const CHOSEN = { proportional: 0.9, pi: 0.3 } as const;
const ROUGHLY = 0.1;
const AS_STIFF = 0.99; // share of the object's stiffness; a device that renders less is softer

/** Largest difference in a quantity between rooms that count as alike. */
export function reach(name: keyof Place, value: number): number {
  const { least, share } = REACH[name];
  return Math.max(least, Math.round(share * value));
}

/** Key to look a room up by, or the reason why there is none; null while there is no hand. */
export function roomFacts(users: readonly UserState[], room: RoomLag, most: number): RoomFacts | Foreign | null {
  const hands = users.filter((user) => user.c_ii > 0 && user.k_h > 0);
  const [first] = hands;
  if (first === undefined) return null;
  if (hands.length > most) return "too many";
  if (hands.some((user) => user.friction)) return "friction";
  if (hands.some((user) => user.law !== first.law)) return "mixed laws";
  if (!answersOwnDent(first.law) && hands.some((user) => user.k_h * user.c_ii < AS_STIFF)) return "soft device";
  const rules = new Set(hands.map(ruleOf));
  const [rule] = rules;
  if (rules.size > 1 || rule === undefined || rule === null) return "own gains";
  return {
    rule,
    hands: hands.length,
    delay: Math.round(1e3 * Math.max(...hands.map((user) => user.loop_delay))),
    coupling: Math.round(1e2 * room.coupling),
    lag: Math.round(1e3 * room.lag),
  };
}

/** Rule that gave a user's gains; null if neither the server nor the paper's rule chose them. */
function ruleOf(user: UserState): Rule | null {
  if (user.law === "predictive") return "predictive";
  const share = user.k_h / user.k_o_coupled;
  if (Math.abs(share / CHOSEN[user.law] - 1) < ROUGHLY) return user.law;
  const alone = user.k_h * user.c_ii;
  return user.law === "proportional" && alone > CHOSEN.proportional - ROUGHLY && alone <= 1 ? "alone" : null;
}

/** Whether a room may keep its former neighbours; otherwise the counts would flicker with each measured delay. */
export function sameRoom(a: RoomFacts, b: RoomFacts): boolean {
  return a.rule === b.rule && a.hands === b.hands && distance(a, b) < 0.2;
}

/** The rooms of the table that are like one. */
export function neighbours(table: Table, facts: RoomFacts): Neighbours {
  const numbers = table[facts.rule][facts.hands - 1] ?? [];
  const found = { rooms: numbers.length / COLUMNS, like: 0, stable: 0, swing: 0, error: 0 };
  let [nearest, least]: [Place | null, number] = [null, Infinity];
  for (let at = 0; at + COLUMNS <= numbers.length; at += COLUMNS) {
    const [delay = 0, coupling = 0, lag = 0, unstable = 0, swing = 0, error = 0] = numbers.slice(at, at + COLUMNS);
    const off = distance(facts, { delay, coupling, lag });
    if (off < least) [nearest, least] = [{ delay, coupling, lag }, off];
    if (off > 1) continue;
    found.like += 1;
    if (unstable === 0) found.stable += 1;
    if (unstable === 0) found.error = Math.max(found.error, error);
    else found.swing = Math.max(found.swing, swing);
  }
  return { ...found, nearest };
}

/** Largest of the differences between two places, each divided by its reach at the first place. */
function distance(a: Place, b: Place): number {
  return Math.max(...(["delay", "coupling", "lag"] as const).map((name) => Math.abs(a[name] - b[name]) / reach(name, a[name])));
}
