import { describe, expect, it } from "vitest";
import { EvenClock } from "../../src/touch/clock";
import { due } from "../../src/touch/loop/schedule";

/** Numbers from 0 to 1, the same each time. */
function chance(): () => number {
  let seed = 1;
  return () => (seed = (seed * 48271) % 2147483647) / 2147483647;
}

interface Run {
  /** Of the loop's periods after the first second. */
  readonly periods: number;
  readonly missed: number;
  /** Largest time between two wakes, by the clock [s]. */
  readonly leap: number;
  /** By how much the clock was off [s]. */
  readonly late: number;
  readonly early: number;
  readonly step: number;
}

/** Ten seconds of a loop that wakes by timers every four milliseconds, more or less. */
function run(coarse: (t: number) => number, lumps = 0.003): Run {
  const random = chance();
  let t = 7.0123;
  const clock = new EvenClock(() => coarse(t));
  let next = clock.now();
  let [periods, missed, leap, late, early, last] = [0, 0, 0, 0, 0, clock.now()];
  for (const end = t + 11; t < end;) {
    t += 0.004 + lumps * random();
    clock.beat();
    const now = clock.now();
    expect(now).toBeGreaterThanOrEqual(last);
    const lost = Math.max(0, now - next - 0.02);
    const [times, after] = due(next, now);
    next = after;
    if (t > end - 10) {
      periods += times.length;
      [leap, late, early] = [Math.max(leap, now - last), Math.max(late, t - now), Math.max(early, now - t)];
      missed += lost;
    }
    last = now;
    // A message that comes between two timers.
    t += 0.0005;
    expect(clock.now()).toBeGreaterThanOrEqual(now);
  }
  return { periods, missed, leap, late, early, step: clock.step };
}

const steps = (step: number) => (t: number): number => Math.floor(t / step) * step;

describe("a clock in steps", () => {
  it.each([0.1, 0.05, 1 / 30, 1 / 60])("of %f s lets the loop run all its periods, few at once", (step) => {
    const found = run(steps(step));
    expect(found.missed).toBe(0);
    expect(Math.abs(found.periods - 10_000)).toBeLessThan(1000 * step + 20);
    expect(found.leap).toBeLessThan(0.02);
    expect(found.step).toBeCloseTo(step, 9);
    expect(Math.max(found.late, found.early)).toBeLessThan(0.4 * step + 0.02);
  });

  it("does so where it steps somewhere between two marks, as Firefox lets it", () => {
    const random = chance();
    const middles = Array.from({ length: 200 }, () => random());
    const jittered = (t: number): number => {
      const mark = Math.floor(t / 0.1);
      return 0.1 * (t / 0.1 - mark >= (middles[mark] ?? 0) ? mark + 1 : mark);
    };
    const found = run(jittered);
    expect(found.missed).toBe(0);
    expect(Math.abs(found.periods - 10_000)).toBeLessThan(220);
  });

  it("is not made of one that goes finer than timers, which is read as it is", () => {
    for (const fine of [(t: number) => t, steps(0.001), steps(0.0001), steps(0.004)]) {
      let t = 3;
      const clock = new EvenClock(() => fine(t));
      for (let i = 0; i < 1000; i++) {
        t += 0.005;
        clock.beat();
        expect(clock.now()).toBe(fine(t));
        t += 0.0007;
        expect(clock.now()).toBe(fine(t));
      }
      expect(clock.step).toBe(0);
    }
  });

  it("goes on from where the clock is after a time in which nothing ran", () => {
    let t = 0;
    const clock = new EvenClock(() => steps(0.1)(t));
    const wake = (seconds: number): void => {
      t += seconds;
      clock.beat();
    };
    for (let i = 0; i < 200; i++) wake(0.004);
    wake(60);
    expect(clock.now()).toBeGreaterThan(t - 0.11);
    for (let i = 0; i < 5; i++) wake(1); // as in the background
    expect(Math.abs(clock.now() - t)).toBeLessThan(0.21);
    expect(clock.step).toBeCloseTo(0.1, 9);
  });

  it("is known to be finer once it is seen to", () => {
    let [t, step] = [0, 0.1];
    const clock = new EvenClock(() => steps(step)(t));
    const wake = (): void => {
      t += 0.005;
      clock.beat();
    };
    for (let i = 0; i < 100; i++) wake();
    expect(clock.step).toBeGreaterThan(0);
    step = 0.001;
    for (let i = 0; i < 100; i++) wake();
    expect(clock.step).toBe(0);
    expect(clock.now()).toBeCloseTo(t, 2);
  });
});
