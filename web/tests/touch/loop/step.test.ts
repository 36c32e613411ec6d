import { describe, expect, test } from "vitest";
import type { LawName } from "../../../src/model/laws";
import { scale, ZERO } from "../../../src/model/vec";
import { nextPatience, receive } from "../../../src/touch/loop/arrival";
import { gainsUnder } from "../../../src/touch/loop/gains";
import { holdBack, slewGain } from "../../../src/touch/loop/slew";
import { loopSettings, START } from "../../../src/touch/loop/state";
import { step } from "../../../src/touch/loop/step";
import { vectors } from "../../vectors";
import { patchOf, type Play, playOut } from "../play";

const plays = vectors("step") as Play[];
const play = plays[0];
const [first, second] = play?.patches ?? [];
if (play === undefined || first === undefined || second === undefined) throw new Error("no vectors");
const settings = loopSettings(0.016, 10, 0.02, 2000);

test.each(plays)("as the Python client, in closed loop with a hand: $name", playOut);

test("an older patch is left out, and one of a server that was started anew is taken", () => {
  const newest = receive(START, patchOf(play, second), 1, settings);
  expect(receive(newest, patchOf(play, first), 1.01, settings)).toBe(newest);
  expect(receive(newest, patchOf(play, second), 1.01, settings)).toBe(newest);
  expect(receive(newest, patchOf(play, first), 1.2, settings).patch?.tick).toBe(first.tick);
});

test("whatever laws follow each other, the force has no step", () => {
  const laws: LawName[] = ["predictive", "pi", "proportional", "pi", "predictive", "proportional"];
  let state = START;
  let before = 0;
  const probe = scale(play.normal, 0.095);
  for (let i = 0; i < 6000; i += 1) {
    const now = i / 1000;
    if (i % 16 === 0) {
      const law = laws[Math.floor(i / 1000)] ?? "pi";
      // The body carries the force of the hand, on which the paper's laws press.
      const patch = { ...first, tick: i + 1, law, k_h: 90, integral_gain: 2000, own_force: scale(play.normal, before) };
      state = receive(state, patchOf(play, patch), now, settings);
    }
    const outside = i < 100 ? scale(play.normal, 0.12) : probe;
    const [after, out] = step(state, { position: outside, velocity: ZERO }, now, settings);
    state = after;
    const size = Math.hypot(...out.force);
    if (i > 1300) expect(Math.abs(size - before), `at ${now} s`).toBeLessThan(0.02 * Math.max(size, 0.05));
    before = size;
  }
  expect(before).toBeGreaterThan(0.1);
});

describe("the motion of others", () => {
  test("moves the surface under a hand by so much in a period, in and out, and not at all in the air", () => {
    expect(holdBack(0.01, 0.02, 1e-4)).toBeCloseTo(0.0101, 9);
    expect(holdBack(0.01, -0.02, 1e-4)).toBeCloseTo(0.0099, 9);
    expect(holdBack(-0.01, 0.02, 1e-4)).toBeCloseTo(1e-4, 9);
    expect(holdBack(0.01, 0.01005, 1e-4)).toBe(0.01005);
    expect(holdBack(-0.02, -0.01, 1e-4)).toBe(-0.01);
  });

  test("that pushes a surface at once comes as 20 N/s, whatever the patch says", () => {
    const given = { ...first, law: "predictive", c_ii: 0.004, k_h: 250, own_force: ZERO } as const;
    const lifted = { ...given, x_free: scale(play.normal, 0.12) };
    let state = START;
    let before = 0;
    for (let i = 0; i < 2600; i += 1) {
      const now = i / 1000;
      if (i % 16 === 0) {
        const patch = i < 2000 ? { ...given, x_free: scale(play.normal, 0.1) } : lifted;
        state = receive(state, patchOf(play, { ...patch, tick: i + 1 }), now, settings);
      }
      const [after, out] = step(state, { position: scale(play.normal, i < 200 ? 0.11 : 0.096), velocity: ZERO }, now, settings);
      state = after;
      const size = Math.hypot(...out.force);
      if (i > 1500) expect(Math.abs(size - before), `at ${now} s`).toBeLessThan(0.0201);
      before = size;
    }
    expect(before).toBeCloseTo(250 * 0.024, 6);
  });
});

describe("a gain", () => {
  const patch = { ...patchOf(play, first), law: "predictive", c_ii: 0.001, k_h: 1000 } as const;
  const under = (c_ii: number): number => gainsUnder(patch, { depth: 0, normal: play.normal, c_ii, own_force: ZERO, u_others: ZERO }, { follow: true, max_stiffness: 2000 }).k_h;

  test("moves by at most a hundredth in a millisecond, and by 10 N/s as far as the force knows", () => {
    expect(slewGain(100, 1000, 0.001)).toBeCloseTo(101.005, 3);
    expect(slewGain(100, 1, 0.001)).toBeCloseTo(99.005, 3);
    expect(slewGain(100, 100.5, 0.001)).toBe(100.5);
    expect(slewGain(100, 1000, 0.001, 5)).toBeCloseTo(100 * Math.exp(0.002), 9);
  });

  test("of the predictive law is the object's own where the probe is, up to the device's", () => {
    expect(under(0.0008)).toBeCloseTo(1250, 9);
    expect(under(0.00055)).toBeCloseTo(1 / 0.00055, 9);
    expect(under(0.0001)).toBeCloseTo(2000, 9); // the patch is believed to half its compliance
    const soft = { ...patch, k_h: 600 };
    const sight = { depth: 0, normal: play.normal, c_ii: 0.0008, own_force: ZERO, u_others: ZERO };
    expect(gainsUnder(soft, sight, { follow: true, max_stiffness: 2000 }).k_h).toBe(600);
    expect(gainsUnder(soft, sight, { follow: false, max_stiffness: 2000 }).k_h).toBe(600);
  });
});

test("a link with long gaps is given twice as long, up to a second, and the gaps are forgotten", () => {
  expect(nextPatience(0, 0.2)).toBeCloseTo(0.4, 9);
  expect(nextPatience(0.4, 0.016)).toBeCloseTo(0.4 * Math.exp(-0.016 / 30), 9);
  expect(nextPatience(0.4, 0.8)).toBe(1);
  // An outage says nothing of the link's way.
  expect(nextPatience(0.4, 3)).toBeLessThan(0.4);
});
