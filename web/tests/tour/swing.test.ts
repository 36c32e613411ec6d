import { describe, expect, it } from "vitest";
import { RESTS, swingOf } from "../../src/tour/swing";

const TIMES = Array.from({ length: 600 }, (_, i) => i / 200);

describe("a swing", () => {
  it("has the size and frequency of a sine, whatever it stands on", () => {
    for (const hz of [0.8, 1.7, 5]) {
      const found = swingOf(TIMES, TIMES.map((t) => 2 + 0.4 * Math.sin(2 * Math.PI * hz * t + 0.3)));
      expect(found?.size).toBeCloseTo(0.8, 2);
      expect(found?.hz).toBeCloseTo(hz, 1);
    }
  });

  it("is none of a constant, of a step or of nothing", () => {
    expect(swingOf(TIMES, TIMES.map(() => 2.02))).toEqual({ size: 0, hz: 0 });
    expect(swingOf(TIMES, TIMES.map((t) => (t > 1 ? 3 : 1)))?.hz).toBe(0);
    expect(swingOf([], [])).toBeNull();
    expect(swingOf([1], [2])).toBeNull();
  });

  it("counts no noise on the way", () => {
    const noisy = TIMES.map((t, i) => Math.sin(2 * Math.PI * t) + (i % 2 === 0 ? 0.05 : -0.05));
    expect(swingOf(TIMES, noisy)?.hz).toBeCloseTo(1, 1);
    expect(RESTS).toBeLessThan(0.1);
  });
});
