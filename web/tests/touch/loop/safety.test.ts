import { describe, expect, test } from "vitest";
import { type Vec3, ZERO } from "../../../src/model/vec";
import { CHAIN } from "../../../src/touch/loop/chain";
import { Period } from "../../../src/touch/loop/period";
import { DEFAULT_LIMITS, NOT_ENGAGED, rateOf, type SafetyLimits, type SafetyState } from "../../../src/touch/loop/safety";
import { loopSettings, START } from "../../../src/touch/loop/state";
import { expectClose } from "../../close";
import { vectors } from "../../vectors";

interface Row {
  now: number;
  /** Null for NaN and infinities. */
  wanted: [number | null, number | null, number | null];
  velocity: Vec3;
  silent: boolean;
  force: Vec3;
  scale: number;
  engaged: boolean;
  fault: string;
  left: number;
}

const GUARD = CHAIN.filter(([name]) => ["fault", "limit", "fade", "rate"].includes(name));

/** Memory after the four rules of the guard, in one period. */
function guard(safety: SafetyState, asked: Vec3, now: number, velocity: Vec3, silent: boolean, limits: SafetyLimits): SafetyState {
  const settings = { ...loopSettings(1 / 60, limits.max_force, limits.stall, 2000), limits };
  const period = new Period({ ...START, safety }, { position: ZERO, velocity }, now, settings);
  Object.assign(period, { asked, silent });
  for (const [, apply] of GUARD) apply(period);
  return period.safety;
}

const rows = vectors("safety") as Row[];

test("as the Python client, whatever law, network and hand do", () => {
  const limits = { ...DEFAULT_LIMITS, max_force: 6, engage_time: 0.05 };
  let state = NOT_ENGAGED;
  const kind = (fault: string): string => fault.split(/ [\d(]/)[0] ?? "";
  rows.forEach(({ now, wanted, velocity, silent, force, scale, engaged, fault, left }, i) => {
    const [x, y, z] = wanted.map((c) => c ?? NaN);
    state = guard(state, [x ?? 0, y ?? 0, z ?? 0], now, velocity, silent, limits);
    expectClose(state, { force, scale, engaged, left }, `row ${i}`);
    // Each language writes numbers that are none in its own way.
    if (wanted.includes(null) || kind(fault) === "the law asked for") expect(kind(state.fault)).toBe(kind(fault));
    else expect(state.fault).toBe(fault);
  });
  const faults = new Set(rows.map(({ fault }) => kind(fault)));
  expect(faults).toEqual(new Set(["", "the hand moved at", "the loop stood still for", "the law asked for"]));
});

describe("a hand", () => {
  const pressed = { ...NOT_ENGAGED, engaged: true, scale: 1, now: 0, force: [6, 0, 0] as const };

  test("is let go within 20 ms without a jerk, for a force that is no number", () => {
    let state = guard(pressed, [NaN, 0, 0], 0.001, ZERO, false, DEFAULT_LIMITS);
    expect(state.fault).toContain("the law asked for");
    let before = 6;
    for (let i = 2; i <= 20; i += 1) {
      state = guard(state, [6, 0, 0], i / 1000, ZERO, false, DEFAULT_LIMITS);
      const [f] = state.force;
      expect(before - f).toBeGreaterThan(-1e-9);
      expect(before - f).toBeLessThan(0.5);
      before = f;
    }
    expect(state).toMatchObject({ force: ZERO, engaged: false });
  });

  test("whose force vanishes loses it no faster than it came", () => {
    const after = guard(pressed, ZERO, 0.001, ZERO, false, DEFAULT_LIMITS);
    expect(after.force[0]).toBeCloseTo(5, 9);
    // A late period counts as two.
    expect(guard(pressed, ZERO, 0.015, ZERO, false, DEFAULT_LIMITS).force[0]).toBeCloseTo(4, 9);
  });

  test("on a stiff device meets its own force in time", () => {
    expect(rateOf(2000)).toBe(1000);
    expect(rateOf(5000)).toBe(2500);
  });

  test("is not engaged inside of an object", () => {
    let state = NOT_ENGAGED;
    for (let i = 0; i < 100; i += 1) state = guard(state, [3, 0, 0], i / 1000, ZERO, false, DEFAULT_LIMITS);
    expect(state).toMatchObject({ force: ZERO, engaged: false });
  });
});
