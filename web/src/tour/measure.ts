/** Measurements of the tour: the own force over the last seconds, and a simulation of the rule for one hand. */

import type { TouchState } from "../model/hand";
import type { SceneSnapshot } from "../model/scene";
import { dot, sub } from "../model/vec";
import { type Held, type Pair, rehearse, type Rehearsed } from "./rehearsal";
import { RESTS, type Swing, swingOf } from "./swing";

/** Seconds of force that are drawn, and the last seconds by which a force is said to be at rest. */
export const SPAN = 8;
const SETTLED = 3;
const SETTLES = 10; // s after a change by the tour in which the force comes to rest, unless somebody else moves
const EVERY = 16; // periods of the loop per kept sample: the trace has one pixel for each sample
const LONG = 40; // s that are simulated, so that a decaying swing has decayed
const LEAST_DEPTH = 1e-4; // m; a hand that presses less is not measured

export class TourMeasure {
  times: number[] = [];
  forces: number[] = [];
  rehearsed: Rehearsed | null = null;
  private seen: TouchState | null = null;
  private skip = 0;
  private disturbed = -Infinity;

  /** Take a report of the own hand, whose periods follow those of the report before. */
  take(state: TouchState): void {
    if (state === this.seen) return;
    this.seen = state;
    for (let i = 0; i + 3 < state.trace.length; i += 4) {
      if (this.skip++ % EVERY !== 0) continue;
      this.times.push(state.trace[i] ?? 0);
      this.forces.push(state.trace[i + 1] ?? 0);
    }
    const from = this.times.findIndex((t) => t > state.t - SPAN);
    if (from > 0) {
      this.times.splice(0, from);
      this.forces.splice(0, from);
    }
  }

  /** Note that the tour made a change at time `t` that moves the own force [s]. */
  disturb(t: number): void {
    this.disturbed = t;
  }

  /** Recent swing of the own force; null before there are enough samples, and while the force may move because of the tour. */
  swing(): Swing | null {
    const end = this.times.at(-1) ?? 0;
    const from = this.times.findIndex((t) => t > end - SETTLED);
    if (from <= 0 || end - SETTLED < this.disturbed) return null;
    const swing = swingOf(this.times.slice(from), this.forces.slice(from));
    return swing !== null && swing.size > RESTS && end < this.disturbed + SETTLES ? null : swing;
  }

  /** Simulate the hands that press now; returns whether there were two. */
  rehearse(view: SceneSnapshot | null, own: TouchState | null, period: number): boolean {
    const pair = view === null || own === null ? null : pairOf(view, own, period);
    if (pair === null) return false;
    this.rehearsed = rehearse(pair, "paper", LONG);
    return true;
  }

  /** Swing of the simulated force at its end. */
  rehearsedSwing(): Swing | null {
    if (this.rehearsed === null) return null;
    const { times, forces } = this.rehearsed;
    const from = times.findIndex((t) => t > LONG - SPAN);
    return swingOf(times.slice(from), forces.slice(from));
  }

  begin(): void {
    [this.times, this.forces, this.rehearsed, this.seen] = [[], [], null, null];
  }
}

/** The own hand, and all other hands as one: with their mean compliance, and the coupling of all of them together. */
export function pairOf(view: SceneSnapshot, own: TouchState, period: number): Pair | null {
  const mine = view.users.find((user) => user.user === own.user && user.c_ii > 0 && user.k_o_coupled > 0);
  const others = view.users.filter((user) => user.user !== own.user && user.c_ii > 0);
  if (mine === undefined || others.length === 0) return null;
  // A loop that is not yet measured must not pass for a loop without delay.
  if ([mine, ...others].some((user) => !(user.loop_delay > 0))) return null;
  const mean = (of: (user: (typeof others)[number]) => number): number =>
    others.reduce((sum, user) => sum + of(user), 0) / others.length;
  // 1 / k_o_coupled = sum over all j of |C_ij|, and C_ii is one of them.
  const coupling = Math.max(0, 1 / mine.k_o_coupled - mine.c_ii);
  const below = (user: (typeof others)[number]): number => Math.max(LEAST_DEPTH, dot(sub(user.foot, user.probe), user.normal));
  const held = (c: number, delay: number, depth: number): Held => ({ c, delay, depth });
  return {
    hands: [held(mine.c_ii, mine.loop_delay, below(mine)), held(mean((user) => user.c_ii), mean((user) => user.loop_delay), mean(below))],
    // A surface that pushes against the hand bulges.
    coupling: own.felt_from_others > 0 ? -coupling : coupling,
    period,
  };
}
