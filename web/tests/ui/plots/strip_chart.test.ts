import { describe, expect, it } from "vitest";
import { withZero } from "../../../src/ui/plots/lanes";
import { gaps } from "../../../src/ui/plots/strip_chart";
import { TraceBuffer } from "../../../src/ui/plots/trace_buffer";

describe("a lane", () => {
  const lane = { zero: true, least: 2 };

  it("has zero at its foot while nothing is felt", () => {
    expect(withZero({ low: 0, high: 0 }, lane)).toEqual({ low: 0, high: 2 });
    expect(withZero(null, lane)).toEqual({ low: 0, high: 2 });
  });

  it("shows values below zero too", () => {
    expect(withZero({ low: -3, high: -1 }, lane)).toEqual({ low: -3, high: 0 });
  });
});

describe("gaps", () => {
  it("are where nothing was heard, and none before the first sample", () => {
    const data = new TraceBuffer(1, 50);
    expect(gaps(data, 0, 100)).toEqual([]);
    for (const t of [10, 10.5, 11, 15, 15.5]) data.push(t, [1]);
    expect(gaps(data, 9, 16)).toEqual([[11, 15]]);
    expect(gaps(data, 12, 18)).toEqual([[12, 15], [15.5, 18]]);
    expect(gaps(data, 15.2, 16)).toEqual([]);
  });
});
