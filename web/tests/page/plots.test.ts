/** Scales, memory of plots, and the stability area. */

import { describe, expect, it } from "vitest";
import { liftedRadius } from "../../src/control/stability";
import { isStable, isStable15, rootsInside, stableOutline } from "../../src/control/stable_set";
import { digits, follow, linear, niceStep, ticks } from "../../src/model/scale";
import type { UserState } from "../../src/model/scene";
import { areaWords } from "../../src/ui/area_card";
import { gainsOf, periods, verdict } from "../../src/ui/plots/area_plot";
import { cut, lean } from "../../src/ui/plots/cut_picture";
import { withZero } from "../../src/ui/plots/strip_chart";
import { Timeline } from "../../src/ui/plots/trace_buffer";
import { sample } from "../../src/ui/user_card";
import { proxyOf } from "../../src/view/pose";
import { user } from "./users";

describe("scales", () => {
  it("map ends to ends", () => {
    const y = linear({ low: -1, high: 3 }, { low: 100, high: 0 });
    expect([y(-1), y(1), y(3)]).toEqual([100, 50, 0]);
    expect(linear({ low: 2, high: 2 }, { low: 0, high: 10 })(2)).toBe(5);
  });

  it("have round numbers", () => {
    expect([0.003, 0.7, 1, 1.2, 3, 80].map(niceStep)).toEqual([0.005, 1, 1, 2, 5, 100]);
    expect(niceStep(0)).toBe(1);
    expect(ticks({ low: 0, high: 20 }, 4)).toEqual([0, 5, 10, 15, 20]);
    expect(ticks({ low: -0.3, high: 0.3 }, 3).map((t) => Number(t.toFixed(3)))).toEqual([-0.2, 0, 0.2]);
    expect([digits(0.05), digits(1), digits(20)]).toEqual([2, 0, 0]);
  });

  it("grow at once, and do not breathe", () => {
    const first = follow(null, { low: 0, high: 3.2 }, 1);
    expect(first.high).toBeGreaterThanOrEqual(3.2);
    expect(follow(first, { low: 0, high: 2.9 }, 1)).toBe(first);
    expect(follow(first, { low: 0, high: 9 }, 1).high).toBeGreaterThanOrEqual(9);
    expect(follow(first, { low: 0, high: 0.5 }, 0.5).high).toBeLessThan(1.1);
  });

  it("keep a least width however still the data are", () => {
    const range = follow(null, { low: 0.2, high: 0.2 }, 0.1);
    expect(range.high - range.low).toBeGreaterThanOrEqual(0.05);
    expect(range.low).toBeLessThanOrEqual(0.2);
    expect(range.high).toBeGreaterThanOrEqual(0.2);
  });
});

describe("a lane", () => {
  const lane = { zero: true, least: 2 };

  it("has zero at its foot while nothing is felt", () => {
    expect(withZero({ low: 0, high: 0 }, lane)).toEqual({ low: 0, high: 2 });
    expect(withZero(null, lane)).toEqual({ low: 0, high: 2 });
  });

  it("shows what is below zero too", () => {
    expect(withZero({ low: -3, high: -1 }, lane)).toEqual({ low: -3, high: 0 });
  });
});

describe("the timeline", () => {
  it("forgets the oldest and keeps the order", () => {
    const t = new Timeline(1, 3);
    for (let i = 1; i <= 5; i++) t.push(i, [10 * i]);
    const seen: number[] = [];
    t.each(0, 0, (time, value) => seen.push(time, value));
    expect(seen).toEqual([3, 30, 4, 40, 5, 50]);
    expect(t.length).toBe(3);
  });

  it("takes a frame once", () => {
    const t = new Timeline(1, 8);
    t.push(1, [1]);
    t.push(1, [2]);
    expect(t.length).toBe(1);
  });

  it("finds the range since a time, gaps left out", () => {
    const t = new Timeline(2, 8);
    t.push(1, [99, 0]);
    t.push(2, [1, Number.NaN]);
    t.push(3, [2, -4]);
    expect(t.range([0, 1], 2)).toEqual({ low: -4, high: 2 });
    expect(t.range([0], 9)).toBeNull();
    t.clear();
    expect(t.last).toBe(-Infinity);
  });
});

describe("stability", () => {
  it("of polynomials is where the roots are", () => {
    // (z - a)(z - b)
    const quadratic = (a: number, b: number): number[] => [1, -(a + b), a * b];
    expect(rootsInside(quadratic(0.9, -0.5))).toBe(true);
    expect(rootsInside(quadratic(1.01, 0.2))).toBe(false);
    expect(rootsInside(quadratic(0.3, -1.2))).toBe(false);
    expect(rootsInside([1, 0, 0.98])).toBe(true);
    expect(rootsInside([1, 0, 1.02])).toBe(false);
  });

  it("without delay is eq. (15)", () => {
    for (let kappa = 0.05; kappa < 3.2; kappa += 0.1) {
      for (let int = 0.05; int < 4.2; int += 0.1) {
        const edge = Math.min(Math.abs(Math.abs(int - kappa) - 1), Math.abs(int - 2 * kappa + 2));
        if (edge > 1e-6) expect(isStable({ kappa, int }, 0)).toBe(isStable15({ kappa, int }));
      }
    }
  });

  it("with delay is that of the lifted system", () => {
    for (const delay of [1, 2, 4, 9]) {
      for (const kappa of [0.1, 0.5, 0.9]) {
        for (const int of [0.02, 0.1, 0.3, 0.8, 1.4]) {
          const radius = liftedRadius({ k_h: kappa, step_gain: int }, { k_o: 1, b_o: 0 }, 1, delay);
          if (Math.abs(radius - 1) > 1e-6) expect(isStable({ kappa, int }, delay)).toBe(radius < 1);
        }
      }
    }
  });

  it("of the proportional law is K_h < K_o at any delay, eq. (8)", () => {
    for (const delay of [0, 3, 40]) {
      expect(isStable({ kappa: 0.99, int: 0 }, delay)).toBe(true);
      expect(isStable({ kappa: 1.01, int: 0 }, delay)).toBe(false);
    }
  });

  it("has an outline that shrinks with delay", () => {
    const height = (d: number): number => Math.max(...stableOutline(d, 20).map(([, int]) => int));
    expect(height(0)).toBeGreaterThan(3.9);
    expect(height(1)).toBeGreaterThan(height(4));
    expect(height(4)).toBeGreaterThan(height(16));
    expect(height(16)).toBeGreaterThan(0);
  });
});

describe("dots in the area", () => {
  const T = 1 / 60;

  it("count a loop in periods beyond the first", () => {
    expect(periods(0, T)).toBe(0);
    expect(periods(3 * T, T)).toBe(3);
    expect(periods(3.1 * T, T)).toBe(4);
    expect(periods(99, T)).toBe(64);
  });

  it("of the paper's rule are inside alone and outside together: that is the point", () => {
    const pressed: UserState = { ...user(1), law: "proportional", c_ii: 1 / 250, k_o_coupled: 140, k_h: 0.95 * 250, integral_gain: 0 };
    expect(verdict(pressed, T, "alone")).toBe("inside");
    expect(verdict(pressed, T, "coupled")).toBe("outside");
    expect(areaWords([pressed], T, 0, "coupled")).toContain("bound to swing: user 1");
    // Where the object takes its time that figure is not the whole of it.
    expect(areaWords([pressed], T, 0.1, "coupled")).toContain("kept from swinging by the room\u2019s lag: user 1");
  });

  it("of the predictive law are no points of this set", () => {
    const own: UserState = { ...user(1), law: "predictive", c_ii: 1 / 250, k_h: 250 };
    expect(verdict(own, T, "coupled")).toBe("own");
    expect(gainsOf(own, T, "coupled")?.kappa).toBeCloseTo(1, 9);
  });

  it("need a contact", () => {
    const nowhere: UserState = { ...user(1), c_ii: 0, k_o_coupled: 0 };
    expect(gainsOf(nowhere, T, "alone")).toBeNull();
    expect(verdict(nowhere, T, "coupled")).toBe("none");
  });
});

describe("what is plotted of a user", () => {
  it("is probe and proxy below the resting surface", () => {
    const pressed: UserState = { ...user(1), foot: [0.1, 0, 0], normal: [1, 0, 0], probe: [0.085, 0, 0], x_free: [0.097, 0, 0], force: [3, 0, 0], c_ii: 0.004 };
    const [probe, proxy, force] = sample(pressed);
    expect(probe).toBeCloseTo(0.015, 9);
    expect(proxy).toBeCloseTo(0.003 + 0.012, 9);
    expect(force).toBe(3);
  });

  it("of a finger that sticks has the tip on the surface, or above it as far as the device is soft", () => {
    const stuck: UserState = {
      ...user(1), law: "predictive", friction: true, probe: [0.085, 0.006, 0], x_free: [0.097, 0, 0], force: [2, 1, 0], c_ii: 0.004, k_h: 250,
    };
    expect(sample(stuck).slice(0, 2)).toEqual([expect.closeTo(0.015, 9), expect.closeTo(0.015, 9)]);
    expect(proxyOf(stuck)).toEqual(stuck.probe);
    expect(sample({ ...stuck, k_h: 125 })[1]).toBeCloseTo(0.015 - 0.008, 9);
  });

  it("has no proxy in the air", () => {
    const above: UserState = { ...user(1), probe: [0.12, 0, 0], x_free: [0.1, 0, 0], force: [0, 0, 0] };
    expect(sample(above)[1]).toBeNaN();
  });
});

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
