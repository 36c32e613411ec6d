import { expect, test } from "vitest";
import type { Player } from "../../src/replay/player";
import { Samples, windowRound } from "../../src/replay/samples";
import { record } from "../watch/scenes";

test("the window has the shown time in it, in the middle where the recording goes on, and is always as long", () => {
  for (let t = 100; t <= 160; t += 0.5) {
    const { start, end } = windowRound(t, 100, 160, 6);
    expect(end - start).toBeCloseTo(6, 9);
    expect(start <= t && t <= end, `${t}`).toBe(true);
    expect(start >= 100 && end <= 160, `${t}`).toBe(true);
    if (t > 103 && t < 157) expect(start).toBe(t - 3);
  }
  expect(windowRound(101, 100, 102, 6)).toEqual({ start: 96, end: 102 });
});

test("every sample of a window comes once, in order, and is made once", () => {
  const times = Float64Array.from({ length: 50 }, (_, k) => k / 10);
  let made = 0;
  const player = { times, usersOf: (i: number) => [record(1, i), record(2, -i)] } as unknown as Player;
  const samples = new Samples(player, (user) => {
    made += 1;
    return [user.probe[0]];
  });
  for (let turn = 0; turn < 3; turn += 1) {
    const seen: number[] = [];
    samples.each({ start: 1, end: 2 }, (user, t, [x]) => {
      if (user === 1) seen.push(t);
      expect(x).toBeCloseTo(user === 1 ? 10 * t : -10 * t, 9);
    });
    expect(seen).toEqual([1, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 2]);
  }
  expect(made).toBe(22);
});
