import { describe, expect, it } from "vitest";
import { beside } from "../../src/view/labels";

describe("a name", () => {
  const tip = { x: 100, y: 100 };

  it("begins where the stem ends, whichever way it points", () => {
    expect(beside(tip, { x: 200, y: 100 }, 40)).toEqual({ x: 240, y: 100 });
    expect(beside(tip, { x: 0, y: 100 }, 40)).toEqual({ x: -40, y: 100 });
    expect(beside(tip, { x: 100, y: 0 }, 40).y).toBeLessThan(-10);
  });

  it("leaves a hand in sight whose stem points at the eye", () => {
    expect(beside(tip, { x: 104, y: 96 }, 40).y).toBeLessThan(60);
  });
});
