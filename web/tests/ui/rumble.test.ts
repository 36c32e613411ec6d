import { describe, expect, it } from "vitest";
import { rumble, vibration } from "../../src/ui/rumble";

describe("feedback", () => {
  it("is silent without a force", () => {
    expect(rumble(0, 0)).toEqual({ strong: 0, weak: 0 });
    expect(vibration(0)).toEqual([]);
  });

  it("grows with the force up to the limit of the motors", () => {
    expect(rumble(3, 0).strong).toBeCloseTo(0.5, 9);
    expect(rumble(60, 300)).toEqual({ strong: 1, weak: 1 });
    const [on, off] = vibration(3);
    expect(on).toBe(off);
  });
});
