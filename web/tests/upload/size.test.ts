import { describe, expect, test } from "vitest";
import { lengthWords, sizeWords, touchable, UNITS, unitOf, type Unit } from "../../src/upload/size";

test.each(Object.keys(UNITS) as Unit[])("%s is known by its scale", (unit) => {
  expect(unitOf(UNITS[unit])).toBe(unit);
  expect(unitOf(1.01 * UNITS[unit])).toBeNull();
});

test.each([
  [0.005, "5 mm"],
  [0.0123, "1.2 cm"],
  [0.5, "50 cm"],
  [1.234, "1.2 m"],
])("%d m is said as %s", (metres, words) => {
  expect(lengthWords(metres)).toBe(words);
});

describe("a size", () => {
  test.each([
    [[0.09, 0.18, 0.04], "18 \u00d7 9 \u00d7 4 cm, about as long as a hand"],
    [[0.23, 0.2, 0.1], "23 \u00d7 20 \u00d7 10 cm, longer than a hand"],
    [[0.006, 0.006, 0.006], "6 \u00d7 6 \u00d7 6 mm, shorter than a pea"],
    [[0.001, 0.004, 0.001], "4 \u00d7 1 \u00d7 1 mm: too small to be touched, at least 5 mm"],
    [[1, 1, 51], "51 \u00d7 1 \u00d7 1 m: too large to be touched, at most 5 m"],
  ] as const)("%j is %s", (sides, words) => {
    expect(sizeWords(sides)).toBe(words);
  });

  test.each([[0.005, true], [5, true], [0.00499, false], [5.001, false], [NaN, false]])("of %d m: %s", (longest, may) => {
    expect(touchable(longest)).toBe(may);
  });
});
