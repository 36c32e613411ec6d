import { describe, expect, it } from "vitest";
import { colourAt, DISPLACEMENT, luminance, parseHex, STIFFNESS, table, toLinear, userColour } from "../../src/model/colours";

describe("colours", () => {
  it("of stiffness get brighter from soft to stiff", () => {
    let before = -1;
    for (let i = 0; i <= 50; i++) {
      const now = luminance(colourAt(STIFFNESS, i / 50));
      expect(now).toBeGreaterThan(before);
      before = now;
    }
  });

  it("of displacement are told apart by the two ends, rest between them", () => {
    const light = DISPLACEMENT.light;
    const [inward, outward] = [colourAt(light, 0.1), colourAt(light, 0.9)];
    expect(inward[2]).toBeGreaterThan(inward[0]);
    expect(outward[0]).toBeGreaterThan(outward[2]);
    expect(luminance(colourAt(light, 0.5))).toBeGreaterThan(Math.max(luminance(inward), luminance(outward)));
  });

  it("beyond the ends stay at the ends, and nothing is no colour of its own", () => {
    expect(colourAt(STIFFNESS, 7)).toEqual(colourAt(STIFFNESS, 1));
    expect(colourAt(STIFFNESS, Number.NaN)).toEqual(colourAt(STIFFNESS, 0));
  });

  it("become linear light in the table", () => {
    const t = table(STIFFNESS, 2);
    expect(t[0]).toBeCloseTo(toLinear(parseHex("#00224e")[0]), 6);
    expect(t[5]).toBeCloseTo(toLinear(parseHex("#fee838")[2]), 6);
  });

  it("of eight users in a row differ, by day and by night", () => {
    for (const scheme of ["light", "dark"] as const) {
      expect(new Set([1, 2, 3, 4, 5, 6, 7, 8].map((u) => userColour(u, scheme))).size).toBe(8);
    }
  });
});
