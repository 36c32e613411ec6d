import { describe, expect, test } from "vitest";
import { moved, readout, valuesAt } from "../../../src/ui/plots/cursor";
import type { Lane } from "../../../src/ui/plots/lanes";
import { TraceBuffer } from "../../../src/ui/plots/trace_buffer";

const LANES: readonly Lane[] = [
  { name: "position", unit: "mm", factor: 1e3, least: 0.01, zero: true, height: 50, lines: [{ column: 0, colour: "", name: "proxy" }, { column: 1, colour: "", name: "probe" }] },
  { name: "force", unit: "N", factor: 1, least: 2, zero: true, height: 30, lines: [{ column: 2, colour: "" }] },
];

describe("a cursor in a plot", () => {
  test("reads the newest sample that is not after it, and nothing in a silence", () => {
    const data = new TraceBuffer(3, 50);
    for (let n = 0; n < 20; n += 1) data.push(n / 10, [0.001 * n, 0.002 * n, n]);
    data.push(6, [1, NaN, 3]);
    expect(valuesAt(data, LANES, 0.57)[1]).toEqual([5]);
    expect(valuesAt(data, LANES, 0.57)[0]?.map((x) => Math.round(1e6 * x))).toEqual([5000, 10000]);
    for (const t of [-0.1, 2.95, 5.9]) expect(valuesAt(data, LANES, t).flat().every(Number.isNaN), `${t}`).toBe(true);
    expect(valuesAt(data, LANES, 6.5).flat()).toEqual([1, NaN, 3]);
  });

  test("says them with their units, and a dash for what is not known", () => {
    expect(readout(LANES, [[0.0121, NaN], [1.234]], "1.20 s ago")).toBe("1.20 s ago: proxy 12.1\u202fmm, probe \u2013, force 1.23\u202fN");
  });

  test("goes by keys, no further than the axis, and away", () => {
    expect(moved(2, 6, "ArrowLeft", false)).toBeCloseTo(2.05, 9);
    expect(moved(2, 6, "ArrowRight", true)).toBeCloseTo(1.5, 9);
    expect(moved(0.2, 6, "ArrowRight", true)).toBe(0);
    expect(moved(null, 6, "Home", false)).toBe(6);
    expect(moved(null, 6, "ArrowLeft", false)).toBeCloseTo(3.05, 9);
    expect(moved(2, 6, "Escape", false)).toBeNull();
    for (const key of ["a", " ", "Tab", "Enter"]) expect(moved(2, 6, key, false)).toBeUndefined();
    expect(moved(null, 6, "Escape", false)).toBeUndefined();
  });
});
