import { describe, expect, it } from "vitest";
import type { Vec3 } from "../../src/model/vec";
import { guidedDirection } from "../../src/page/tour_place";

describe("the guided hand", () => {
  const left = { direction: [-1, 0, 0] as Vec3, busy: 3 };
  const right = { direction: [1, 0, 0] as Vec3, busy: 1 };

  it("stands opposite to a single other", () => {
    expect(guidedDirection([left], [0, -1, 0])[0]).toBeGreaterThan(0.95);
  });

  it("keeps away from the others, next to the place opposite to who moves most, in sight", () => {
    const d = guidedDirection([left, right], [0.2, -0.9, 0]);
    expect(Math.acos(d[0])).toBeGreaterThan(0.7);
    expect(Math.acos(d[0])).toBeLessThan(0.95);
    expect(d[1]).toBeLessThan(0);
  });

  it("comes to who looks, where nobody else is", () => {
    expect(guidedDirection([], [0, -0.9, 0.4])).toEqual([0, -1, 0]);
  });
});
