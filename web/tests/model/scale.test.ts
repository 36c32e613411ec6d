import { describe, expect, it } from "vitest";
import { digits, follow, linear, niceStep, ticks } from "../../src/model/scale";

describe("scales", () => {
  it("map ends to ends", () => {
    const y = linear({ low: -1, high: 3 }, { low: 100, high: 0 });
    expect([y(-1), y(1), y(3)]).toEqual([100, 50, 0]);
    expect(linear({ low: 2, high: 2 }, { low: 0, high: 10 })(2)).toBe(5);
  });

  it("have round numbers", () => {
    expect([0.003, 0.7, 1, 1.2, 3, 80].map(niceStep)).toEqual([0.005, 1, 1, 2, 5, 100]);
    expect(niceStep(0)).toBe(1);
    expect(ticks({ low: 0, high: 20 }, 4)).toEqual([0, 5, 10, 15, 20]);
    expect(ticks({ low: -0.3, high: 0.3 }, 3).map((t) => Number(t.toFixed(3)))).toEqual([-0.2, 0, 0.2]);
    expect([digits(0.05), digits(1), digits(20)]).toEqual([2, 0, 0]);
  });

  it("grow at once, and do not breathe", () => {
    const first = follow(null, { low: 0, high: 3.2 }, 1);
    expect(first.high).toBeGreaterThanOrEqual(3.2);
    expect(follow(first, { low: 0, high: 2.9 }, 1)).toBe(first);
    expect(follow(first, { low: 0, high: 9 }, 1).high).toBeGreaterThanOrEqual(9);
    expect(follow(first, { low: 0, high: 0.5 }, 0.5).high).toBeLessThan(1.1);
  });

  it("keep a least width however still the data are", () => {
    const range = follow(null, { low: 0.2, high: 0.2 }, 0.1);
    expect(range.high - range.low).toBeGreaterThanOrEqual(0.05);
    expect(range.low).toBeLessThanOrEqual(0.2);
    expect(range.high).toBeGreaterThanOrEqual(0.2);
  });
});
