import { expect, test } from "vitest";
import { outlineFor, referenceFor } from "../../src/view/reference";

test.each([
  [0.005, "the tip of a finger, 1.6 cm wide", 0.016, 0.03],
  [0.2, "a hand, 18 cm", 0.121, 0.18],
  [3, "a person, 1.7 m", 0.64, 1.7],
])("beside an object of %d m stands %s, as large as it is", (longest, words, width, height) => {
  const reference = referenceFor(longest);
  expect(reference.words).toBe(words);
  expect(reference.height).toBeCloseTo(height, 3);
  expect(reference.width).toBeCloseTo(width, 2);
  reference.dispose();
});

test("every object has something beside it", () => {
  for (let longest = 1e-4; longest < 1e3; longest *= 1.3) expect(outlineFor(longest).strokes.length).toBeGreaterThan(0);
});
