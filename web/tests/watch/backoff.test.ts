import { expect, test } from "vitest";
import { wait } from "../../src/watch/backoff";

test("attempts come less and less often, up to a bound, and not in step", () => {
  expect([1, 2, 3, 9].map((failures) => wait(failures, 1))).toEqual([0.5, 1, 2, 8]);
  expect(wait(9, 0)).toBe(4);
});
