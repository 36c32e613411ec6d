import { expect, test } from "vitest";
import { add, cross, dot, isFinite3, lerp, norm, scale, sub, unit, type Vec3, ZERO } from "../../src/model/vec";

const a: Vec3 = [1, -2, 3];
const b: Vec3 = [4, 0.5, -1];

test("a product is at right angles to both", () => {
  expect(dot(cross(a, b), a)).toBeCloseTo(0, 12);
  expect(dot(cross(a, b), b)).toBeCloseTo(0, 12);
  expect(cross([1, 0, 0], [0, 1, 0])).toEqual([0, 0, 1]);
});

test("an added vector can be subtracted, and a line goes from end to end", () => {
  expect(sub(add(a, b), b)).toEqual(a);
  expect(lerp(a, b, 0)).toEqual(a);
  expect(lerp(a, b, 1)).toEqual(b);
  expect(scale(a, 2)).toEqual(add(a, a));
});

test("a direction has length 1, and nothing has the fallback", () => {
  expect(norm(unit(a))).toBeCloseTo(1, 15);
  expect(unit(ZERO, b)).toBe(b);
});

test("one bad number spoils a point", () => {
  expect(isFinite3(a)).toBe(true);
  expect(isFinite3([0, NaN, 0])).toBe(false);
  expect(isFinite3([0, 0, Infinity])).toBe(false);
});
