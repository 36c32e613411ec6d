import { expect, test } from "vitest";
import type { TouchState } from "../../src/model/hand";
import { TourMeasure } from "../../src/tour/measure";

const PERIOD = 0.001; // s
const REPORT = 0.02; // s

/** Reports from one time to another, of a force that is a function of time. */
function feel(measure: TourMeasure, from: number, to: number, force: (t: number) => number): void {
  for (let t = from; t < to; t += REPORT) {
    const trace: number[] = [];
    for (let s = t; s < t + REPORT; s += PERIOD) trace.push(s, force(s), 0, 0);
    measure.take({ t: t + REPORT, trace: Float64Array.from(trace) } as unknown as TouchState);
  }
}

const settling = (t: number): number => 2 + Math.exp(-2 * (t - 10));
const moved = (t: number): number => 2 + Math.sin(t);

test("a force that the tour has just changed is judged once it has come to rest", () => {
  const measure = new TourMeasure();
  feel(measure, 0, 10, () => 3);
  expect(measure.swing()?.size).toBe(0);
  measure.disturb(10);
  for (let t = 10; t < 20; t += 0.5) {
    feel(measure, t, t + 0.5, settling);
    const swing = measure.swing();
    if (swing !== null) expect(swing.size).toBeLessThan(0.02);
  }
  expect(measure.swing()).not.toBeNull();
});

test("one that does not come to rest is judged later, since somebody moves it", () => {
  const measure = new TourMeasure();
  feel(measure, 0, 10, moved);
  expect(measure.swing()?.size).toBeGreaterThan(0.5);
  measure.disturb(10);
  feel(measure, 10, 19.5, moved);
  expect(measure.swing()).toBeNull();
  feel(measure, 19.5, 20.5, moved);
  expect(measure.swing()?.size).toBeGreaterThan(0.5);
});
