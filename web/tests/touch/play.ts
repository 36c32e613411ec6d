/** Whole seconds of one haptic loop, as `tests/client/loop/plays.py` wrote them. */

import { expect } from "vitest";
import type { HandSettings } from "../../src/model/hand";
import { add, scale, type Vec3, ZERO } from "../../src/model/vec";
import type { Patch } from "../../src/protocol/patch";
import { receive } from "../../src/touch/loop/arrival";
import type { Period } from "../../src/touch/loop/period";
import type { SafetyLimits } from "../../src/touch/loop/safety";
import { move } from "../../src/touch/loop/simulated_hand";
import { type LoopSettings, loopSettings, type LoopState, START } from "../../src/touch/loop/state";
import { step } from "../../src/touch/loop/step";
import { expectClose } from "../close";
import { NOTHING_CUT } from "../users";

const PERIODS = 1500; // of a millisecond

export type PlayPatch = Pick<
  Patch,
  "tick" | "t_server" | "law" | "x_free" | "c_ii" | "k_h" | "integral_gain" | "own_force" | "u_others" | "compliance"
>;

export interface Play {
  name: string;
  simulation_period: number;
  limits: SafetyLimits;
  max_damping: number;
  max_stiffness: number;
  /** mu; with it the hand slides to and fro. */
  friction: number;
  release_time: number;
  hand: HandSettings;
  normal: Vec3;
  along: Vec3;
  curvature: number;
  way: [number, number][];
  /** Periods in which the loop was not run. */
  left_out: number[];
  patches: ({ at: number } & PlayPatch)[];
  rows: { i: number; [field: string]: unknown }[];
}

export function patchOf(play: Play, given: PlayPatch): Patch {
  return {
    ...given,
    seq: 0,
    t_client: 0,
    sample_wait: 0,
    geometry: "sphere",
    normal: play.normal,
    curvature: play.curvature,
    room: { lag: 0, coupling: 0, margin: Infinity },
    neighbourhood: null,
    ledger: NOTHING_CUT,
  };
}

export function settingsOf(play: Play): LoopSettings {
  const { simulation_period, limits, max_damping, friction, max_stiffness } = play;
  const basic = loopSettings(simulation_period, limits.max_force, limits.stall, max_stiffness);
  expect(basic.law.release_time).toBe(play.release_time);
  expect(basic.limits.silent_after).toBe(limits.silent_after);
  return { ...basic, limits, max_damping, friction };
}

/** Run it, and compare every row that was written down. */
export function playOut(play: Play): void {
  const settings = settingsOf(play);
  const rows = new Map(play.rows.map((row) => [row.i, row]));
  let state = START;
  let tip = { position: wanted(play, 0), velocity: ZERO };
  let force = ZERO;
  let next = 0;
  for (let i = 0; i < PERIODS; i += 1) {
    const now = Number((i * 0.001).toFixed(6));
    tip = move(tip, play.hand, wanted(play, now), force, 0.001);
    if (play.left_out.includes(i)) continue;
    for (let come = play.patches[next]; come !== undefined && come.at <= now; come = play.patches[next]) {
      state = receive(state, patchOf(play, come), now, settings);
      next += 1;
    }
    const [after, out] = step(state, tip, now, settings);
    state = after;
    force = out.force;
    const row = rows.get(i);
    rows.delete(i);
    if (row !== undefined) expectClose({ i, ...seen(state, out) }, row, `${play.name} at ${now} s`, 1e-9, 1e-11);
  }
  expect(rows.size).toBe(0);
}

function wanted(play: Play, t: number): Vec3 {
  const aside = play.friction === 0 ? 0 : Number((0.004 * Math.sin(9 * t)).toFixed(9));
  return add(scale(play.normal, 0.1 - depthAt(play.way, t)), scale(play.along, aside));
}

function depthAt(way: Play["way"], t: number): number {
  for (let i = 1; i < way.length; i += 1) {
    const [t0, a] = way[i - 1] ?? [0, 0];
    const [t1, b] = way[i] ?? [0, 0];
    if (t < t1) return a + ((b - a) * Math.max(0, t - t0)) / (t1 - t0);
  }
  return way.at(-1)?.[1] ?? 0;
}

function seen(state: LoopState, out: Period): Record<string, unknown> {
  return {
    probe: state.probe,
    force: out.force,
    on_body: out.on_body,
    normal_force: out.local.normal_force,
    felt_from_others: out.local.felt_from_others,
    u_others: out.u_others,
    damping_force: out.damping_force,
    silent: out.silent,
    patience: state.patience,
    behind: state.playout.behind,
    depth: Number.isFinite(state.depth) ? state.depth : null,
    k_h: state.fade?.now.gains.k_h ?? 0,
    owed: state.passivity.owed,
    stored: state.passivity.stored,
    friction: state.friction.force,
    scale: state.safety.scale,
    left: state.safety.left,
    engaged: state.safety.engaged,
  };
}
