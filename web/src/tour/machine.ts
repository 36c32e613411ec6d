/**
 * The guided tour as a state machine: the current step, its start time, and whether its condition holds.
 *
 * A step is data. The tour goes on by itself when the step's condition holds and there was time to read; after too long a
 * wait it says so and goes on without the condition. Steps that the server does not allow are skipped, with a sentence.
 */

import type { LawChoice, LawName } from "../model/laws";
import type { Swing } from "./swing";

/** State of the live system that the steps depend on. */
export interface Facts {
  /** Other users with a hand on the body. */
  readonly others: number;
  /** Whether the tour's partner is here, or may still come. */
  readonly coming: boolean;
  readonly allowFixedGains: boolean;
  /** Whether the own hand is in the room. */
  readonly touching: boolean;
  /** Force on the own hand, and the part of it that comes from the others [N]. */
  readonly force: number;
  readonly fromOthers: number;
  /** Lag of the room: time in which the object responds to the others [s]. */
  readonly lag: number;
  /** Measured delay of the own loop [s]. */
  readonly loopDelay: number;
  /** The law that runs, and whether its gain is the paper's rule. */
  readonly law: LawName | null;
  readonly paper: boolean;
  /** Swing of the own force in the last seconds; null until enough seconds have passed since the tour's last change took effect. */
  readonly swing: Swing | null;
  /** Simulated swing under the paper's rule without the room's lag, with the values measured here; null before. */
  readonly rehearsed: Swing | null;
}

/** An action on the page when a step begins. */
export type Action =
  | { readonly kind: "touch" }
  /** Bring a partner if nobody else is here. */
  | { readonly kind: "partner" }
  | { readonly kind: "rehearse" }
  | { readonly kind: "press"; readonly depth: number }
  | { readonly kind: "lift" }
  | { readonly kind: "hold"; readonly grip: "natural" | "firm" }
  | { readonly kind: "law"; readonly law: LawChoice }
  | { readonly kind: "delay"; readonly delay: number }
  | { readonly kind: "measure"; readonly by: "alone" | "coupled" }
  | { readonly kind: "colour"; readonly by: "displacement" | "stiffness" }
  | { readonly kind: "look"; readonly at: "stage" | "hand" | "plots" | "area" | "room" };

export interface Step {
  readonly id: string;
  readonly title: string;
  readonly text: string;
  readonly actions: readonly Action[];
  /** Condition under which the step is complete; absent where reading is enough. */
  readonly until?: (facts: Facts) => boolean;
  /** The condition as the end of a sentence that begins with "Waiting until". */
  readonly waiting?: string;
  /** Sentence on the step's effect as measured just now, whatever the numbers are. */
  readonly claim?: (facts: Facts) => string;
  /** Reason why the step cannot be shown; null if it can. */
  readonly without?: (facts: Facts) => string | null;
}

export interface TourState {
  readonly index: number;
  /** The steps that were shown before this one. */
  readonly before: readonly number[];
  /** Time at which the step began [s]. */
  readonly since: number;
  /** Time since which the step's condition has held without a gap [s]; null while it does not hold. */
  readonly heldSince: number | null;
  readonly paused: boolean;
  /** Words about steps that were left out on the way to this one. */
  readonly skipped: readonly string[];
  readonly ended: boolean;
}

export interface Turn {
  readonly state: TourState;
  /** Actions to be done now. */
  readonly actions: readonly Action[];
}

const HOLD = 1.0; // s that a condition has to hold
const PATIENCE = 25; // s after which a step goes on without

/** Time in which a visitor reads the step's text [s]. */
export function readingTime(step: Step): number {
  return 3 + (step.title.length + step.text.length) / 17;
}

export function start(steps: readonly Step[], facts: Facts, now: number): Turn {
  return enter(steps, 0, [], facts, now, false, []);
}

/** Update the state from the live system; goes on to the next step when it is time. */
export function tick(steps: readonly Step[], state: TourState, facts: Facts, now: number): Turn {
  const step = steps[state.index];
  if (state.ended || step === undefined) return { state, actions: [] };
  const holds = step.until === undefined || step.until(facts);
  const heldSince = holds ? (state.heldSince ?? now) : null;
  const next: TourState = { ...state, heldSince };
  const read = now - state.since >= readingTime(step);
  const proven = heldSince !== null && (step.until === undefined || now - heldSince >= HOLD);
  const tired = now - state.since >= Math.max(PATIENCE, readingTime(step));
  const last = state.index === steps.length - 1;
  if (!state.paused && !last && ((read && proven) || tired)) return goTo(steps, next, state.index + 1, facts, now);
  return { state: next, actions: [] };
}

/** Go on by hand to the next step that can be shown; after the last one the tour ends. */
export function goNext(steps: readonly Step[], state: TourState, facts: Facts, now: number): Turn {
  return goTo(steps, state, state.index + 1, facts, now);
}

export function goBack(steps: readonly Step[], state: TourState, facts: Facts, now: number): Turn {
  const can = state.before.filter((index) => shown(steps[index], facts));
  return enter(steps, can.at(-1) ?? 0, can.slice(0, -1), facts, now, state.paused, []);
}

/** Begin the same step anew. */
export function again(steps: readonly Step[], state: TourState, facts: Facts, now: number): Turn {
  return state.ended ? { state, actions: [] } : goTo(steps, state, state.index, facts, now);
}

export function pause(state: TourState, paused: boolean): TourState {
  return { ...state, paused };
}

/** Number of this step among the steps that are shown, and the number of these steps as far as it is known now. */
export function place(steps: readonly Step[], { index, before }: TourState, facts: Facts): readonly [number, number] {
  const coming = steps.slice(index + 1).filter((step) => shown(step, facts));
  return [before.length + 1, before.length + 1 + coming.length];
}

/** Whether the step still waits for the live system. */
export function waits(steps: readonly Step[], state: TourState): boolean {
  const step = steps[state.index];
  return !state.ended && step?.until !== undefined && state.heldSince === null;
}

function shown(step: Step | undefined, facts: Facts): boolean {
  return (step?.without?.(facts) ?? null) === null;
}

function goTo(steps: readonly Step[], state: TourState, index: number, facts: Facts, now: number): Turn {
  const before = index > state.index ? [...state.before, state.index] : state.before;
  return enter(steps, index, before, facts, now, state.paused, []);
}

function enter(
  steps: readonly Step[],
  index: number,
  before: readonly number[],
  facts: Facts,
  now: number,
  paused: boolean,
  skipped: readonly string[],
): Turn {
  const step = steps[index];
  if (step === undefined) {
    const at = Math.max(0, Math.min(steps.length - 1, index));
    return { state: { index: at, before, since: now, heldSince: null, paused, skipped, ended: true }, actions: [] };
  }
  const why = step.without?.(facts) ?? null;
  if (why !== null) return enter(steps, index + 1, before, facts, now, paused, [...skipped, why]);
  return { state: { index, before, since: now, heldSince: null, paused, skipped: [...new Set(skipped)], ended: false }, actions: step.actions };
}
