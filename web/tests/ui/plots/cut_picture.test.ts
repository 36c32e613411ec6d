import { describe, expect, it } from "vitest";
import { cut, lean } from "../../../src/ui/plots/cut_picture";

describe("the cut through the surface", () => {
  const state = { target: [0.08, 0, 0], probe: [0.09, 0, 0], normal: [1, 0, 0], depth: 0.01, indentation: 0.008 } as const;

  it("has the surface above the tip above the cursor", () => {
    const c = cut(state, 0.03);
    expect(c.surface).toBeLessThan(c.tip);
    expect(c.tip).toBeLessThan(c.cursor);
    expect(c.cursor * c.depth).toBeCloseTo(0.02, 9);
  });

  it("has the force as it leans, and upright without friction", () => {
    expect(lean({ force: [3, 0, 0], normal: [1, 0, 0] })).toBe(0);
    expect(lean({ force: [3, 0, -3], normal: [1, 0, 0] })).toBeCloseTo(Math.PI / 4, 9);
    expect(lean({ force: [0, 0, 0], normal: [1, 0, 0] })).toBe(0);
  });

  it("grows with the depth at once and shrinks slowly", () => {
    const deep = cut({ ...state, depth: 0.05 }, 0.03);
    expect(deep.depth).toBeGreaterThan(0.06);
    expect(cut(state, deep.depth).depth).toBeGreaterThan(0.9 * deep.depth);
  });
});
