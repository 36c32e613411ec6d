import { expect, test } from "vitest";
import { leftWords, TimeLeft } from "../../src/upload/time_left";

test("time left goes by the rate of the phase so far, and each phase begins anew", () => {
  const left = new TimeLeft();
  expect(left.seconds("filling", 0, 10)).toBeNull();
  expect(left.seconds("filling", 0.5, 11)).toBeNull();
  expect(left.seconds("filling", 0.25, 20)).toBe(30);
  expect(left.seconds("factoring", 0.25, 21)).toBeNull();
  expect(left.seconds("factoring", 1, 31)).toBe(0);
});

test.each([
  [null, ""],
  [1, "a few seconds left"],
  [12, "about 15 s left"],
  [54, "about 55 s left"],
  [61, "about 2 min left"],
])("%s is said as %s", (seconds, words) => {
  expect(leftWords(seconds)).toBe(words);
});
