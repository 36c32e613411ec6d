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

  it("of sixteen who are here differ, and can be told apart", () => {
    const colours = new UserColours();
    const here = Array.from({ length: 16 }, (_, i) => 3 * i + 5);
    colours.present(here);
    for (const scheme of ["light", "dark"] as const) {
      const seen = here.map((user) => oklab(parseHex(colours.of(user, scheme))));
      seen.forEach((a, i) => {
        for (const b of seen.slice(i + 1)) expect(Math.hypot(...a.map((x, k) => x - (b[k] ?? 0)))).toBeGreaterThan(0.055);
      });
    }
  });

  it("of users stand out from the panel behind them", () => {
    const panel = { light: "#fbfbfa", dark: "#13171b" };
    for (const scheme of ["light", "dark"] as const) {
      for (const colour of USERS[scheme]) {
        const [a, b] = [luminance(parseHex(colour)), luminance(parseHex(panel[scheme]))];
        // What WCAG 2.2 asks of what is no text.
        expect((Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), colour).toBeGreaterThan(3);
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

describe("colours of users", () => {
  it.each(["light", "dark"] as const)("are told apart, and from every colour of the field: %s", (scheme) => {
    const users = USERS[scheme].map((colour) => oklab(parseHex(colour)));
    const field = DISPLACEMENT[scheme].map(oklab);
    users.forEach((user, i) => {
      // 0.02 is just seen side by side; the two greens of before were 0.06 apart.
      for (const other of [...users.slice(i + 1), ...field]) expect(Math.hypot(...user.map((x, k) => x - (other[k] ?? 0)))).toBeGreaterThan(0.08);
    });
  });
});

/** As differences are seen (Ottosson's OKLab). */
function oklab(colour: readonly [number, number, number]): number[] {
  const [r, g, b] = [toLinear(colour[0]), toLinear(colour[1]), toLinear(colour[2])];
  const l = Math.cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const m = Math.cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const s = Math.cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return [
    0.2104542553 * l + 0.793617785 * m - 0.0040720468 * s,
    1.9779984951 * l - 2.428592205 * m + 0.4505937099 * s,
    0.0259040371 * l + 0.7827717662 * m - 0.808675766 * s,
  ];
}

/** Hue [degrees] and chroma, 0 to 1. */
function hueOf([r, g, b]: readonly [number, number, number]): [number, number] {
  const [high, low] = [Math.max(r, g, b), Math.min(r, g, b)];
  const chroma = high - low;
  const sextant = high === r ? (g - b) / chroma : high === g ? 2 + (b - r) / chroma : 4 + (r - g) / chroma;
  return [(60 * (sextant + 6)) % 360, chroma];
}
