import { expect, test } from "vitest";
import { Traffic } from "../../src/watch/traffic";

test("counts all messages, and the last second", () => {
  const traffic = new Traffic();
  for (let i = 0; i < 60; i += 1) traffic.push(i / 30, 100);
  expect([traffic.frames, traffic.bytes]).toEqual([60, 6000]);
  expect(traffic.rates(2)).toEqual({ frames: 29, bytes: 2900 });
  expect(traffic.rates(4)).toEqual({ frames: 0, bytes: 0 });
});
