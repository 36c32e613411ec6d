import { describe, expect, test } from "vitest";
import { DEFAULT_LIMITS, guard, NOT_ENGAGED } from "../../src/touch/safety";
import type { Vec3 } from "../../src/types";
import { ZERO } from "../../src/vec";
import { expectClose } from "../close";
import { vectors } from "../vectors";

interface Row {
  now: number;
  wanted: Vec3;
  velocity: Vec3;
  silent: boolean;
  force: Vec3;
  scale: number;
  engaged: boolean;
  fault: string;
}

const rows = vectors("safety") as Row[];

test("as the Python client, whatever law, network and hand do", () => {
  const limits = { ...DEFAULT_LIMITS, max_force: 6, engage_time: 0.05 };
  let state = NOT_ENGAGED;
  rows.forEach(({ now, wanted, velocity, silent, force, scale, engaged, fault }, i) => {
    state = guard(state, wanted, now, velocity, silent, limits);
    expectClose(state, { force, scale, engaged, fault }, `row ${i}`);
  });
  // The rows have both faults, and a limited rate.
  const faults = new Set(rows.map(({ fault }) => fault));
  expect(faults.size).toBe(3);
});

describe("a hand", () => {
  test("gets nothing for a force that is no number", () => {
    const engaged = { ...NOT_ENGAGED, engaged: true, scale: 1, now: 0 };
    const after = guard(engaged, [NaN, 0, 0], 0.001, ZERO, false, DEFAULT_LIMITS);
    expect(after).toMatchObject({ force: ZERO, engaged: false });
    expect(after.fault).toContain("the law asked for");
  });

  test("is not engaged inside of an object", () => {
    let state = NOT_ENGAGED;
    for (let i = 0; i < 100; i += 1) state = guard(state, [3, 0, 0], i / 1000, ZERO, false, DEFAULT_LIMITS);
    expect(state).toMatchObject({ force: ZERO, engaged: false });
  });
});
