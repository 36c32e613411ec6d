import { expect, test } from "vitest";
import { PageWait } from "../../src/touch/page_wait";

test("the longest wait of late counts for four seconds at least and eight at most", () => {
  const wait = new PageWait();
  expect(wait.longest).toBe(0);
  let now = 100;
  const hear = (seconds: number, until: number): void => {
    for (; now < until; now += 0.1) wait.heard(now - seconds, now);
  };
  hear(0.001, 102);
  wait.heard(now - 0.15, now);
  hear(0.001, 106);
  expect(wait.longest).toBeCloseTo(0.15, 9);
  hear(0.001, 110.2);
  expect(wait.longest).toBeCloseTo(0.001, 9);
});

test("what was before a long silence is forgotten, and a clock that is ahead is no wait", () => {
  const wait = new PageWait();
  wait.heard(1, 1.2);
  wait.heard(60.001, 60);
  expect(wait.longest).toBe(0);
});
