/**
 * Simulation of two hands at one object without the lag that the server gives the object. On the object itself everybody
 * in the room would feel a force that swings.
 *
 * The laws are those of this page (`control/`), the compliances and delays those measured at this object now. The hands
 * are held still, like the hands of the tour and those of the paper's figures. A force reaches the body, and
 * the body's answer reaches the hand, after the measured delay of the whole loop, in ticks of the simulation.
 */

import { predictiveForce } from "../control/predictive";
import { proportionalForce } from "../control/proportional";
import { PAPER } from "../model/laws";

/** One hand of the two. */
export interface Held {
  /** Compliance of its contact [m/N]. */
  readonly c: number;
  /** Measured delay of its whole loop [s]. */
  readonly delay: number;
  /** Depth at which it is held below the resting surface [m]. */
  readonly depth: number;
}

export interface Pair {
  readonly hands: readonly [Held, Held];
  /** Displacement of one contact inward for a unit force on the other [m/N]; negative where it bulges. */
  readonly coupling: number;
  /** Simulation period N T [s]. */
  readonly period: number;
}

/** Force on the first hand, one sample per tick. */
export interface Rehearsed {
  readonly times: readonly number[];
  readonly forces: readonly number[];
}

const MOST = 10; // N; largest force that the page's hand renders
const LATER = 0.25; // s after which the second hand comes down: two hands that come at once would stay alike

/**
 * @param law The paper's rule for one hand, or the predictive law, for both hands.
 * @param seconds Length of the simulation.
 */
export function rehearse(pair: Pair, law: "paper" | "predictive", seconds: number): Rehearsed {
  const { hands, coupling, period } = pair;
  const ticks = Math.ceil(seconds / period);
  const late = hands.map(({ delay }) => Math.max(1, Math.round(delay / period)));
  const past: [number[], number[]] = [[], []];
  const times: number[] = [];
  for (let k = 0; k < ticks; k++) {
    const next = hands.map((hand, i) => {
      const arrived = k - (late[i] ?? 1);
      const own = arrived < 0 ? 0 : (past[i as 0 | 1][arrived] ?? 0);
      const other = arrived < 0 ? 0 : (past[(1 - i) as 0 | 1][arrived] ?? 0);
      const down = i === 0 || k * period >= LATER ? hand.depth : 0;
      const free = down - coupling * other;
      const force = law === "predictive"
        ? predictiveForce(free, 1 / hand.c)
        : proportionalForce(free - hand.c * own, PAPER / hand.c);
      return Math.min(MOST, force);
    });
    past[0].push(next[0] ?? 0);
    past[1].push(next[1] ?? 0);
    times.push(k * period);
  }
  return { times, forces: past[0] };
}
