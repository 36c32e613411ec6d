/** What the tour measures: the own force over the last seconds, and the rehearsal of the rule for one hand. */

import type { TouchState } from "../model/hand";
import type { SceneSnapshot } from "../model/scene";
import { dot, sub } from "../model/vec";
import { type Held, type Pair, rehearse, type Rehearsed } from "./rehearsal";
import { RESTS, type Swing, swingOf } from "./swing";

/** Seconds that are drawn, and those of them by which a force is said to rest. */
export const SPAN = 8;
const SETTLED = 3;
const SETTLES = 10; // s in which what the tour has changed comes to rest, or somebody else moves
const EVERY = 16; // periods of the loop between two samples that are kept: the trace has a pixel for each
const LONG = 40; // s that are rehearsed, so that what dies away has done so
const LEAST_DEPTH = 1e-4; // m; a hand that presses less is not measured

export class TourMeasure {
  times: number[] = [];
  forces: number[] = [];
  rehearsed: Rehearsed | null = null;
  private seen: TouchState | null = null;
  private skip = 0;
  private disturbed = -Infinity;

  /** A report of the own hand: its periods follow those of the one before. */
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

  /** The tour has changed something at `t` that moves the own force [s]. */
  disturb(t: number): void {
    this.disturbed = t;
  }

  /** Of the own force lately; null before there is so much of it, and while it may move because the tour moved it. */
  swing(): Swing | null {
    const end = this.times.at(-1) ?? 0;
    const from = this.times.findIndex((t) => t > end - SETTLED);
    if (from <= 0 || end - SETTLED < this.disturbed) return null;
    const swing = swingOf(this.times.slice(from), this.forces.slice(from));
    return swing !== null && swing.size > RESTS && end < this.disturbed + SETTLES ? null : swing;
  }

  /** Rehearse with the hands that press now; whether there were two. */
  rehearse(view: SceneSnapshot | null, own: TouchState | null, period: number): boolean {
    const pair = view === null || own === null ? null : pairOf(view, own, period);
    if (pair === null) return false;
    this.rehearsed = rehearse(pair, "paper", LONG);
    return true;
  }

  /** Of what was rehearsed, at its end. */
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

/** The own hand, and all others taken as one: as stiff as theirs in the mean, coupled as all of them together. */
export function pairOf(view: SceneSnapshot, own: TouchState, period: number): Pair | null {
  const mine = view.users.find((user) => user.user === own.user && user.c_ii > 0 && user.k_o_coupled > 0);
  const others = view.users.filter((user) => user.user !== own.user && user.c_ii > 0);
  if (mine === undefined || others.length === 0) return null;
  // A loop that was not measured yet is no loop without delay.
  if ([mine, ...others].some((user) => !(user.loop_delay > 0))) return null;
  const mean = (of: (user: (typeof others)[number]) => number): number =>
    others.reduce((sum, user) => sum + of(user), 0) / others.length;
  // 1 / k_o_coupled = sum over all j of |C_ij|, and C_ii is one of them.
  const coupling = Math.max(0, 1 / mine.k_o_coupled - mine.c_ii);
  const below = (user: (typeof others)[number]): number => Math.max(LEAST_DEPTH, dot(sub(user.foot, user.probe), user.normal));
  const held = (c: number, delay: number, depth: number): Held => ({ c, delay, depth });
  return {
    hands: [held(mine.c_ii, mine.loop_delay, below(mine)), held(mean((user) => user.c_ii), mean((user) => user.loop_delay), mean(below))],
    // What pushes against the hand bulges.
    coupling: own.felt_from_others > 0 ? -coupling : coupling,
    period,
  };
}
