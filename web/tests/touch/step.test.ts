import { describe, expect, test } from "vitest";
import type { Patch } from "../../src/protocol/patch";
import { move } from "../../src/touch/hand";
import type { SafetyLimits } from "../../src/touch/safety";
import { type LoopSettings, loopSettings, type LoopState, type Output, receive, slewGain, START, step } from "../../src/touch/step";
import type { HandSettings, LawName, Vec3 } from "../../src/types";
import { scale, ZERO } from "../../src/vec";
import { expectClose } from "../close";
import { vectors } from "../vectors";

type PlayPatch = Pick<Patch, "tick" | "law" | "x_free" | "c_ii" | "k_h" | "integral_gain" | "own_force" | "u_others">;

interface Play {
  name: string;
  simulation_period: number;
  limits: SafetyLimits;
  max_damping: number;
  release_time: number;
  hand: HandSettings;
  normal: Vec3;
  curvature: number;
  way: [number, number][];
  patches: ({ at: number } & PlayPatch)[];
  rows: { i: number; [field: string]: unknown }[];
}

const plays = vectors("step") as Play[];

function patchOf(play: Play, given: PlayPatch): Patch {
  return {
    ...given,
    seq: 0,
    t_server: 0,
    t_client: 0,
    sample_wait: 0,
    geometry: "sphere",
    normal: play.normal,
    curvature: play.curvature,
    k_o: 1 / given.c_ii,
    k_o_coupled: 1 / given.c_ii,
    neighbourhood: null,
    compliance: null,
  };
}

function depthAt(way: Play["way"], t: number): number {
  for (let i = 1; i < way.length; i += 1) {
    const [t0, a] = way[i - 1] ?? [0, 0];
    const [t1, b] = way[i] ?? [0, 0];
    if (t < t1) return a + ((b - a) * Math.max(0, t - t0)) / (t1 - t0);
  }
  return way.at(-1)?.[1] ?? 0;
}

function seen(state: LoopState, out: Output): Record<string, unknown> {
  return {
    probe: state.probe,
    force: out.force,
    on_body: out.on_body,
    normal_force: out.local.normal_force,
    felt_from_others: out.local.felt_from_others,
    damping_force: out.damping_force,
    silent: out.silent,
    k_h: state.fade?.now.gains.k_h ?? 0,
    owed: state.passivity.owed,
    scale: state.safety.scale,
    engaged: state.safety.engaged,
  };
}

describe("as the Python client, in closed loop with a hand", () => {
  test.each(plays)("$name", (play) => {
    const basic = loopSettings(play.simulation_period, play.limits.max_force, play.limits.stall);
    expect(basic.law.release_time).toBe(play.release_time);
    expect(basic.limits.silent_after).toBe(play.limits.silent_after);
    const settings: LoopSettings = { ...basic, limits: play.limits, max_damping: play.max_damping };
    const rows = new Map(play.rows.map((row) => [row.i, row]));
    let state = START;
    let tip = { position: scale(play.normal, 0.1 - (play.way[0]?.[1] ?? 0)), velocity: ZERO };
    let force = ZERO;
    let next = 0;
    for (let i = 0; i < 1500; i += 1) {
      const now = Number((i * 0.001).toFixed(6));
      for (let come = play.patches[next]; come !== undefined && come.at <= now; come = play.patches[next]) {
        state = receive(state, patchOf(play, come), now, settings);
        next += 1;
      }
      const target = scale(play.normal, 0.1 - depthAt(play.way, now));
      tip = move(tip, play.hand, target, force, 0.001);
      const [after, out] = step(state, tip, now, settings);
      state = after;
      force = out.force;
      const row = rows.get(i);
      if (row !== undefined) expectClose({ i, ...seen(state, out) }, row, `${play.name} at ${now} s`, 1e-9, 1e-11);
    }
  });
});

test("an older patch is left out, and one of a server that was started anew is taken", () => {
  const [play] = plays;
  const [first, second] = play?.patches ?? [];
  if (play === undefined || first === undefined || second === undefined) throw new Error("no vectors");
  const settings = loopSettings(0.016, 10, 0.02);
  const newest = receive(START, patchOf(play, second), 1, settings);
  expect(receive(newest, patchOf(play, first), 1.01, settings)).toBe(newest);
  expect(receive(newest, patchOf(play, second), 1.01, settings)).toBe(newest);
  expect(receive(newest, patchOf(play, first), 1.2, settings).patch?.tick).toBe(first.tick);
});

test("whatever laws follow each other, the force has no step", () => {
  const [play] = plays;
  const given = play?.patches[0];
  if (play === undefined || given === undefined) throw new Error("no vectors");
  const settings = loopSettings(0.016, 10, 0.02);
  const laws: LawName[] = ["predictive", "pi", "proportional", "pi", "predictive", "proportional"];
  let state = START;
  let before = 0;
  const probe = scale(play.normal, 0.095);
  for (let i = 0; i < 6000; i += 1) {
    const now = i / 1000;
    if (i % 16 === 0) {
      const law = laws[Math.floor(i / 1000)] ?? "pi";
      // The body carries what the hand gave: what the paper's laws press on.
      const patch = { ...given, tick: i + 1, law, k_h: 90, integral_gain: 2000, own_force: before };
      state = receive(state, patchOf(play, patch), now, settings);
    }
    const outside = i < 100 ? scale(play.normal, 0.12) : probe;
    const [after, out] = step(state, { position: outside, velocity: ZERO }, now, settings);
    state = after;
    const size = Math.hypot(...out.force);
    if (i > 1300) expect(Math.abs(size - before), `at ${now} s`).toBeLessThan(0.02 * Math.max(size, 0.05));
    before = size;
  }
});

test("a gain moves by at most a hundredth in a millisecond", () => {
  expect(slewGain(100, 1000, 0.001)).toBeCloseTo(101.005, 3);
  expect(slewGain(100, 1, 0.001)).toBeCloseTo(99.005, 3);
  expect(slewGain(100, 100.5, 0.001)).toBe(100.5);
});
