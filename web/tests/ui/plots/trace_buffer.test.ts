import { describe, expect, it } from "vitest";
import { TraceBuffer } from "../../../src/ui/plots/trace_buffer";

describe("a trace buffer", () => {
  it("forgets the oldest and keeps the order", () => {
    const t = new TraceBuffer(1, 3);
    for (let i = 1; i <= 5; i++) t.push(i, [10 * i]);
    const seen: number[] = [];
    t.each(0, 0, (time, value) => seen.push(time, value));
    expect(seen).toEqual([3, 30, 4, 40, 5, 50]);
    expect(t.length).toBe(3);
  });

  it("takes a frame once", () => {
    const t = new TraceBuffer(1, 8);
    t.push(1, [1]);
    t.push(1, [2]);
    expect(t.length).toBe(1);
  });

  it("finds the range since a time, gaps left out", () => {
    const t = new TraceBuffer(2, 8);
    t.push(1, [99, 0]);
    t.push(2, [1, Number.NaN]);
    t.push(3, [2, -4]);
    expect(t.range([0, 1], 2)).toEqual({ low: -4, high: 2 });
    expect(t.range([0], 9)).toBeNull();
    t.clear();
    expect(t.last).toBe(-Infinity);
  });
});
