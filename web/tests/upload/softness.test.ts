import { expect, test } from "vitest";
import { MATERIALS, positionOf, softnessWords, STEPS, youngAt } from "../../src/upload/softness";

test("the slider rises from softer than jelly to harder than rubber", () => {
  for (let i = 1; i <= STEPS; i++) expect(youngAt(i)).toBeGreaterThanOrEqual(youngAt(i - 1));
  expect(youngAt(0)).toBeLessThan(MATERIALS[0]?.young ?? 0);
  expect(youngAt(STEPS)).toBeGreaterThan(MATERIALS.at(-1)?.young ?? Infinity);
});

test.each(MATERIALS)("$name is found on it and called so", ({ name, young }) => {
  const there = youngAt(positionOf(young));
  expect(Math.abs(Math.log(there / young))).toBeLessThan(0.06);
  expect(softnessWords(there)).toMatch(new RegExp(`^like ${name}, `));
});

test.each([
  [1e3, "softer than jelly, 1 kPa"],
  [3e4, "softer than silicone, 30 kPa"],
  [1.3e4, "harder than liver, 13 kPa"],
  [3e6, "harder than rubber, 3 MPa"],
])("%d Pa is %s", (young, words) => {
  expect(softnessWords(young)).toBe(words);
});
