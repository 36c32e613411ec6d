import { describe, expect, it } from "vitest";
import { colourAt, DISPLACEMENT, luminance, parseHex, STIFFNESS, table, toLinear, USERS, UserColours } from "../../src/model/colours";

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

  it("of users who are here differ, whoever has come and gone before", () => {
    const colours = new UserColours();
    for (const here of [[1, 2, 3], [2, 3, 9], [9, 17, 25, 33, 41, 49, 57, 65], [2, 65, 66, 67, 68, 69, 70, 73]]) {
      colours.present(here);
      for (const scheme of ["light", "dark"] as const) {
        expect(new Set(here.map((user) => colours.of(user, scheme))).size).toBe(here.length);
      }
    }
  });

  it("of who stays stay, and more users than colours are no error", () => {
    const colours = new UserColours();
    colours.present([1, 2]);
    const second = colours.of(2, "light");
    colours.present([2, 9, 10]);
    expect(colours.of(2, "light")).toBe(second);
    expect(colours.of(10, "light")).not.toBe(second);
    colours.present(Array.from({ length: 40 }, (_, i) => i));
    expect(colours.of(39, "dark")).toMatch(/^#/);
  });

  it("of users are neither the blue nor the amber of the field", () => {
    for (const scheme of ["light", "dark"] as const) {
      const field = [0.05, 0.15, 0.25, 0.75, 0.85, 0.95].map((t) => hueOf(colourAt(DISPLACEMENT[scheme], t)));
      for (const colour of USERS[scheme]) {
        const [hue, chroma] = hueOf(parseHex(colour));
        for (const [other] of field) {
          const apart = Math.abs(((hue - other + 540) % 360) - 180);
          expect(chroma < 0.1 || apart > 14, `${scheme} ${colour}`).toBe(true);
        }
      }
    }
  });
});

/** Hue [degrees] and chroma, 0 to 1. */
function hueOf([r, g, b]: readonly [number, number, number]): [number, number] {
  const [high, low] = [Math.max(r, g, b), Math.min(r, g, b)];
  const chroma = high - low;
  const sextant = high === r ? (g - b) / chroma : high === g ? 2 + (b - r) / chroma : 4 + (r - g) / chroma;
  return [(60 * (sextant + 6)) % 360, chroma];
}
