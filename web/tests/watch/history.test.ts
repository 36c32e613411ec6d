import { expect, test } from "vitest";
import { Histories, Ring } from "../../src/watch/history";
import { record } from "./scenes";

test("a ring keeps the newest, oldest first", () => {
  const ring = new Ring(3);
  expect(ring.length).toBe(0);
  expect(ring.value(0)).toBeNaN();
  for (let i = 0; i < 5; i += 1) ring.push(i, 10 * i);
  expect([0, 1, 2].map((i) => [ring.time(i), ring.value(i)])).toEqual([[2, 20], [3, 30], [4, 40]]);
  expect(ring.value(3)).toBeNaN();
  expect(ring.value(-1)).toBeNaN();
});

test("a history has force, depth and gains of each user", () => {
  const histories = new Histories();
  histories.push(5, [record(1, 0.09), record(2, 0.12)]);
  expect(histories.get(3)).toBeNull();
  const one = histories.get(1);
  expect(one?.force.value(0)).toBe(1);
  expect(one?.depth.value(0)).toBeCloseTo(0.01, 9);
  expect(histories.get(2)?.depth.value(0)).toBeCloseTo(-0.02, 9);
  expect(one?.k_h.time(0)).toBe(5);
});

test("a room through which many go does not fill the memory", () => {
  const histories = new Histories();
  for (let user = 1; user <= 200; user += 1) histories.push(user, [record(user), record(1)]);
  expect(histories.get(1)?.force.length).toBeGreaterThan(100);
  expect(histories.get(2)).toBeNull();
  expect(histories.get(200)).not.toBeNull();
});
