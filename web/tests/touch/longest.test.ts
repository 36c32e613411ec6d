import { expect, test } from "vitest";
import { Longest } from "../../src/touch/longest";

test("the longest time of late counts for four seconds at least and eight at most", () => {
  const wait = new Longest();
  expect(wait.value).toBe(0);
  let now = 100;
  const hear = (seconds: number, until: number): void => {
    for (; now < until; now += 0.1) wait.note(seconds, now);
  };
  hear(0.001, 102);
  wait.note(0.15, now);
  hear(0.001, 106);
  expect(wait.value).toBeCloseTo(0.15, 9);
  hear(0.001, 110.2);
  expect(wait.value).toBeCloseTo(0.001, 9);
});

test("what was before a long silence is forgotten, and a clock that is ahead is no wait", () => {
  const wait = new Longest();
  wait.note(0.2, 1.2);
  wait.note(-0.001, 60);
  expect(wait.value).toBe(0);
});
