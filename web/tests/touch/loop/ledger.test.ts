import { expect, test } from "vitest";
import { ENTRIES } from "../../../src/model/rules";
import { LAWS } from "../../../src/model/laws";
import { scale, type Vec3, ZERO } from "../../../src/model/vec";
import { receive } from "../../../src/touch/loop/arrival";
import { ledgerOf } from "../../../src/touch/loop/ledger";
import { loopSettings, START } from "../../../src/touch/loop/state";
import { step } from "../../../src/touch/loop/step";
import type { Patch } from "../../../src/protocol/patch";
import { NOTHING_CUT } from "../../users";

/** Numbers from 0 to 1 that are the same at each run (mulberry32). */
function chance(seed: number): () => number {
  let a = seed;
  return () => {
    a = (a + 0x6d2b79f5) | 0;
    let t = Math.imul(a ^ (a >>> 15), 1 | a);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
}

const up: Vec3 = [0, 0, 1];

/** A second and a half of a hand, with all that may happen to it; returns which entries acted. */
function live(seed: number): Set<string> {
  const next = chance(seed);
  const one = <T>(of: readonly T[]): T => of[Math.floor(next() * of.length)] as T;
  const settings = { ...loopSettings(0.016, one([10, 1.5]), 0.02, 2000), max_damping: one([0, 7]), friction: one([0, 0.4]) };
  const acted = new Set<string>();
  let state = START;
  let [law, c_ii, level, goal, depth, own, now, due, silent] = [one(LAWS), 0.004, 0.1, -0.01, -0.01, 0, 0, 0, 0];
  for (let i = 0; i < 1500; i += 1) {
    now += next() < 0.001 ? 0.05 : 0.001; // a stall is a fault
    if (next() < 0.002) law = one(LAWS);
    if (next() < 0.004) c_ii = 1 / (100 + 1500 * next());
    if (next() < 0.006) level += 0.008 * (next() - 0.5);
    if (next() < 0.006) goal = one([-0.01, 0.005, 0.02]);
    if (next() < 0.001) silent = now + 0.4;
    if (now >= due) {
      due = now + 0.016;
      const normal: Vec3 = [0.1 * Math.sin(3 * now), 0, Math.cos(0.1 * Math.sin(3 * now))];
      const patch: Patch = {
        seq: 0, t_client: 0, sample_wait: 0, tick: i + 1, t_server: now, law, geometry: "plane", x_free: scale(up, level), normal, curvature: 0, c_ii,
        k_h: 0.9 / c_ii, integral_gain: 2000, own_force: scale(up, own), u_others: [0.001 * next(), 0, 0], compliance: [c_ii, c_ii, c_ii, 0, 0, 0],
        room: { lag: 0, coupling: 0, margin: Infinity }, neighbourhood: null, ledger: NOTHING_CUT,
      };
      if (now > silent) state = receive(state, patch, now, settings);
    }
    const before = depth;
    depth += Math.max(-4e-4, Math.min(4e-4, 0.05 * (goal - depth)));
    const wrong = next() < 0.0005;
    const sample = { position: [wrong ? Infinity : 0.002 * Math.sin(9 * now), 0, 0.1 - depth] as Vec3, velocity: wrong ? ZERO : scale(up, (before - depth) / 0.001) };
    const [after, period] = step(state, sample, now, settings);
    state = wrong ? { ...state, safety: after.safety } : after;
    const ledger = ledgerOf(period);
    own = Math.hypot(...period.force);
    const sum = Object.values(ledger).reduce((a, b) => a + b, 0);
    expect(Math.abs(sum - own), `history ${seed} at ${now} s: ${JSON.stringify(ledger)}`).toBeLessThan(1e-9);
    for (const [name, newtons] of Object.entries(ledger)) if (Math.abs(newtons) > 0.01) acted.add(name);
  }
  return acted;
}

test("the entries of any period add up to the force that the hand was given, and each rule acts in some", () => {
  const acted = new Set(Array.from({ length: 60 }, (_, seed) => [...live(seed)]).flat());
  expect([...acted].sort()).toEqual(Object.keys(ENTRIES).filter((name) => name !== "models").sort());
});
