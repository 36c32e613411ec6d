import { expect, test } from "vitest";
import { deviceDampingLimit, dissipate, givenEnergy, NOTHING_OWED, observe } from "../../../src/touch/loop/passivity";
import { expectClose } from "../../close";
import { vectors } from "../../vectors";

interface Row {
  spring: { stored: number; ratio: number; scale: number };
  force: number;
  speed_in: number;
  work: number;
  from_body: number;
  dt: number;
  after: object;
  damped: number;
}

test("as the Python client, energy comes and is taken out", () => {
  let state = NOTHING_OWED;
  (vectors("passivity") as Row[]).forEach((v, i) => {
    const [damping, damped] = dissipate(state, v.force, v.speed_in, v.dt, 6);
    const stored = givenEnergy(v.spring.stored, v.spring.ratio, v.spring.scale);
    const owed = observe(state.owed, v.work, stored - state.stored, v.from_body, v.dt);
    state = { owed, damping, stored };
    expectClose(state, v.after, `after ${i}`);
    expectClose(damped, v.damped, `damped ${i}`);
  });
});

test("a device that damps less than Colgate's bound gets none of ours", () => {
  expect(deviceDampingLimit(0.5, 2000, 0.001)).toBe(0);
  expect(deviceDampingLimit(4, 2000, 0.001)).toBe(3);
  expect(deviceDampingLimit(50, 2000, 0.001)).toBe(8);
});
