import { expect, test } from "vitest";
import { Delays } from "../../src/tour/delays";

test("a hand that comes after the ocean is as far away as the one that was there", () => {
  const delays = new Delays();
  expect(delays.due([3, 0])).toEqual([]);
  delays.wanted = 0.12;
  expect(delays.due([3, 0])).toEqual([{ user: 3, delay: 0.12 }]);
  expect(delays.due([3, 0])).toEqual([]);
  expect(delays.due([3, 4])).toEqual([{ user: 4, delay: 0.12 }]);
  // A lost connection comes back under another number.
  expect(delays.due([5, 4])).toEqual([{ user: 5, delay: 0.12 }]);
  delays.wanted = 0;
  expect(delays.due([5, 4])).toEqual([{ user: 5, delay: 0 }, { user: 4, delay: 0 }]);
  expect(delays.due([5, 4, 6])).toEqual([]);
});
