import { describe, expect, it } from "vitest";
import type { UserState } from "../../../src/model/scene";
import { gainsOf, periods, verdict } from "../../../src/ui/plots/area_plot";
import { user } from "../../users";

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
