import { describe, expect, test } from "vitest";
import {
  anchorOf,
  believedShift,
  followMaterial,
  type FrictionState,
  frictionStep,
  NO_FRICTION,
  normalShift,
  type Slide,
  tangents,
  times,
  wedging,
} from "../../src/control/friction";
import type { Compliance3 } from "../../src/model/body";
import { cross, dot, norm, type Vec3, ZERO } from "../../src/model/vec";
import { expectClose } from "../close";
import { type Play, playOut } from "../touch/play";
import { vectors } from "../vectors";

const { steps, play } = vectors("friction") as { steps: (Slide & { aside: number; after: FrictionState })[]; play: Play };

describe("as the Python client", () => {
  test("a finger sticks, slips, is dragged and lets go", () => {
    let state = NO_FRICTION;
    steps.forEach(({ aside, after, ...slide }, i) => {
      expectClose(normalShift(state, slide.normal, slide.C), aside, `aside ${i}`);
      state = frictionStep(state, slide);
      expectClose(state, after, `after ${i}`);
    });
    // The steps have both, or they show nothing.
    const shares = steps.filter(({ after }) => after.touching).map(({ after, mu, normal_force }) => norm(after.force) / (mu * normal_force));
    expect(Math.max(...shares)).toBeCloseTo(1, 9);
    expect(Math.min(...shares)).toBeLessThan(0.9);
  });

  test("in closed loop with a hand that slides to and fro", () => {
    playOut(play);
  });
});

const EVEN: Compliance3 = [0.004, 0.004, 0.004, 0, 0, 0];
const AT_REST: Slide = {
  moved: ZERO, material: ZERO, normal: [0, 0, 1], normal_force: 3, C: EVEN, mu: 0.8, fraction: 1, max_stiffness: 1e4, max_change: 100,
};

test("material that others drag takes a finger that sticks along, by its stiffness", () => {
  let state = frictionStep(NO_FRICTION, AT_REST);
  state = frictionStep(state, { ...AT_REST, material: [0.005, 0, 0] });
  // The force on the hand is towards where the material went: 5 mm over 4 mm/N.
  expectClose(state.force, [1.25, 0, 0], "force");
  expect(state.touching).toBe(true);
});

test("a drag comes no faster than allowed, and a displacement from before the touch is none", () => {
  const came = frictionStep(NO_FRICTION, { ...AT_REST, material: [0.005, 0, 0] });
  expectClose(came.force, [0, 0, 0], "force on coming");
  const [carried, followed] = followMaterial(came, [0.009, 0, 0], 0.001);
  expectClose([carried, followed], [[0.001, 0, 0], [0.006, 0, 0]], "way");
  const slow = frictionStep(came, { ...AT_REST, material: [0.009, 0, 0], max_change: 0.02 });
  expect(norm(slow.force)).toBeLessThanOrEqual(0.02);
  expect(norm(slow.force)).toBeGreaterThan(0.005);
});

test("a finger slips where friction cannot hold it, and a soft device gives no more than it renders", () => {
  const far = frictionStep(NO_FRICTION, { ...AT_REST, moved: [0.02, 0, 0] });
  expect(norm(far.force)).toBeCloseTo(0.8 * 3, 9);
  const soft = frictionStep(NO_FRICTION, { ...AT_REST, moved: [0.004, 0, 0], max_stiffness: 100 });
  expect(norm(soft.force)).toBeLessThanOrEqual(100 * 0.004);
});

test("without pressure or friction there is none, and a body gives way both ways alike", () => {
  const stuck = frictionStep(NO_FRICTION, { ...AT_REST, moved: [0.001, 0, 0] });
  expect(frictionStep(stuck, { ...AT_REST, normal_force: 0 })).toBe(NO_FRICTION);
  expect(frictionStep(stuck, { ...AT_REST, mu: 0 })).toBe(NO_FRICTION);
  expect(frictionStep(stuck, { ...AT_REST, C: [0, 0, 0, 0, 0, 0] })).toBe(NO_FRICTION);
  const C: Compliance3 = [1, 2, 3, 0.1, 0.2, 0.3];
  const [a, b]: [Vec3, Vec3] = [[1, -2, 0.5], [0.3, 0.7, -1]];
  expect(dot(a, times(C, b))).toBeCloseTo(dot(b, times(C, a)), 12);
});

test.each([[[1, 0, 0]], [[0, 0, -1]], [[0.6, 0.8, 0]]] as [Vec3][])("two directions along the surface at %j", (normal) => {
  const [one, two] = tangents(normal);
  expectClose([norm(one), norm(two), dot(one, two), dot(one, normal)], [1, 1, 0, 0], "frame");
  expectClose(cross(one, two), normal, "right-handed");
});

test("a law stiffer than the body takes a part of the shift by friction, any other takes all of it", () => {
  const C: Compliance3 = [0.012, 0.012, 0.012, 0, 0.01, 0];
  expect(believedShift([0, 0, 1], C, 80)).toBe(1);
  expect(believedShift([0, 0, 1], C, 250)).toBeCloseTo(1 / (250 * 0.012), 12);
  expect(wedging(0.5, [0, 0, 1], C, 80)).toBeCloseTo(0.5 * 80 * 0.01, 12);
  expect(wedging(0.5, [0, 0, 1], C, 1e6)).toBeCloseTo(0.5 * (0.01 / 0.012), 12);
  expect(wedging(0.5, [0, 0, 1], EVEN, 1e6)).toBe(0);
});

test("the anchor is the tip less its way over the material, out to the surface and back by the material's way", () => {
  const state = { ...NO_FRICTION, touching: true, stretch: [0.001, 0, 0] as Vec3, material: [0, 0.002, 0.003] as Vec3 };
  expectClose(anchorOf(state, [0.1, 0, 0], [0, 0, 1], 0.004) ?? [], [0.099, -0.002, 0.001], "anchor");
  expect(anchorOf(NO_FRICTION, [0.1, 0, 0], [0, 0, 1], 0.004)).toBe(null);
});
