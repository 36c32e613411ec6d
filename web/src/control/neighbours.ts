/**
 * Rooms of the campaign that are like this one, and how they went.
 *
 * The campaign (`experiments/neighbours.py`) has run random rooms under each law. Of every room its table has six
 * whole numbers: the longest loop [ms], the coupling m in hundredths, the lag [ms], whether it was unstable, the swing
 * of its last seconds [% of the largest force], and the largest error of a steady force in thousandths.
 */

import type { RoomLag } from "../model/body";
import { answersOwnDent } from "../model/laws";
import type { UserState } from "../model/scene";

/** Whose gains: of a law with all hands in mind, or of the paper's rule, which considers one contact alone. */
export type Rule = "predictive" | "pi" | "proportional" | "alone";

/** What a room is looked up by; whole numbers, as in the table. */
export interface RoomFacts {
  readonly rule: Rule;
  readonly hands: number;
  /** The longest loop [ms]. */
  readonly delay: number;
  /** m, in hundredths. */
  readonly coupling: number;
  /** [ms] */
  readonly lag: number;
}

/** For each rule, for 1, 2, ... hands: the numbers of all rooms one after the other. */
export type Table = Readonly<Record<Rule, readonly (readonly number[])[]>>;

type Place = Pick<RoomFacts, "delay" | "coupling" | "lag">;

export interface Neighbours {
  /** Rooms of the same rule with as many hands. */
  readonly rooms: number;
  /** Of them within reach in loop, coupling and lag. */
  readonly like: number;
  readonly stable: number;
  /** Largest swing of those that were not stable [% of the largest force]. */
  readonly swing: number;
  /** Largest error of a steady force of those that were [thousandths]. */
  readonly error: number;
  /** The room that comes nearest; null where there is none of the rule with as many hands. */
  readonly nearest: Place | null;
}

/** Why the campaign has no rooms like this one at all. */
export type Foreign = "too many" | "mixed laws" | "own gains" | "friction" | "soft device";

const COLUMNS = 6;
/** How far off a room may be to count as like another: so much, or such a share, whichever is more. */
export const REACH: Readonly<Record<keyof Place, { readonly least: number; readonly share: number }>> = {
  delay: { least: 20, share: 0.25 },
  coupling: { least: 10, share: 0.2 },
  lag: { least: 20, share: 0.4 },
};
// K_h over the stiffness with all hands that the server chooses for the paper's laws (`gains.py`), and how much is rounding
// and a hand that has just moved.
const CHOSEN = { proportional: 0.9, pi: 0.3 } as const;
const ROUGHLY = 0.1;
const AS_STIFF = 0.99; // of the object; a device that renders less is softer

/** How far a room may be off in a quantity. */
export function reach(name: keyof Place, value: number): number {
  const { least, share } = REACH[name];
  return Math.max(least, Math.round(share * value));
}

/** What a room is looked up by, or why it cannot be; null while there is no hand. */
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

/** Who chose these gains; null for neither the server nor the paper's rule. */
function ruleOf(user: UserState): Rule | null {
  if (user.law === "predictive") return "predictive";
  const share = user.k_h / user.k_o_coupled;
  if (Math.abs(share / CHOSEN[user.law] - 1) < ROUGHLY) return user.law;
  const alone = user.k_h * user.c_ii;
  return user.law === "proportional" && alone > CHOSEN.proportional - ROUGHLY && alone <= 1 ? "alone" : null;
}

/** Whether it is the same room as before, as far as neighbours go; else counts would flicker with each delay. */
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

/** The largest of the differences, each over its reach round the first. */
function distance(a: Place, b: Place): number {
  return Math.max(...(["delay", "coupling", "lag"] as const).map((name) => Math.abs(a[name] - b[name]) / reach(name, a[name])));
}
