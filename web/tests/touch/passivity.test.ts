import { expect, test } from "vitest";
import { deviceDampingLimit, dissipate, NOTHING_OWED, observe } from "../../src/touch/passivity";
import { expectClose } from "../close";
import { vectors } from "../vectors";

interface Row {
  force: number;
  own_force: number;
  surface_moved: number;
  speed_in: number;
  dt: number;
  seen: number;
  after: object;
  damped: number;
}

test("as the Python client, energy comes and is taken out", () => {
  let state = NOTHING_OWED;
  (vectors("passivity") as Row[]).forEach((v, i) => {
    const owed = observe(state.owed, v.force, v.own_force, v.surface_moved, v.dt);
    expectClose(owed, v.seen, `seen ${i}`);
    const [after, damped] = dissipate({ owed, damping: state.damping }, v.force, v.speed_in, v.dt, 6);
    expectClose(after, v.after, `after ${i}`);
    expectClose(damped, v.damped, `damped ${i}`);
    state = after;
  });
});

test("a device that damps less than Colgate's bound gets none of ours", () => {
  expect(deviceDampingLimit(0.5, 2000, 0.001)).toBe(0);
  expect(deviceDampingLimit(4, 2000, 0.001)).toBe(3);
  expect(deviceDampingLimit(50, 2000, 0.001)).toBe(8);
});
