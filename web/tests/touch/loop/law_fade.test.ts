import { expect, test } from "vitest";
import { DEFAULT_LAW_SETTINGS } from "../../../src/control/law";
import { run, settled, switchLaw } from "../../../src/touch/loop/law_fade";

const SIGHT = { depth: 1e-4, normal: [0, 0, 1], c_ii: 1e-5, own_force: [0, 0, 0], u_others: [0, 0, 0] } as const;

test("also where hardly anything is felt, a change of law moves the force by a hundredth in a millisecond", () => {
  let fade = settled("proportional", { k_h: 100, integral_gain: 0 });
  let before = 0.01;
  fade = switchLaw(fade, "predictive", { k_h: 20_000, integral_gain: 0 }, before, SIGHT);
  for (let i = 0; i < 3000; i += 1) {
    const [after, force] = run(fade, SIGHT, 0.001, DEFAULT_LAW_SETTINGS, 0, 0.01);
    fade = after;
    const { normal_force } = force;
    expect(normal_force - before).toBeLessThan(0.0101 * Math.max(normal_force, 0.05));
    before = normal_force;
  }
  expect(fade.before).toBeNull();
  expect(before).toBeCloseTo(2, 6);
});

test("a law that is in use already is not changed", () => {
  const fade = settled("pi", { k_h: 100, integral_gain: 0 });
  expect(switchLaw(fade, "pi", { k_h: 5, integral_gain: 0 }, 1, SIGHT)).toBe(fade);
});
