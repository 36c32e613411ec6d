import { describe, expect, it } from "vitest";
import { withZero } from "../../../src/ui/plots/strip_chart";

describe("a lane", () => {
  const lane = { zero: true, least: 2 };

  it("has zero at its foot while nothing is felt", () => {
    expect(withZero({ low: 0, high: 0 }, lane)).toEqual({ low: 0, high: 2 });
    expect(withZero(null, lane)).toEqual({ low: 0, high: 2 });
  });

  it("shows values below zero too", () => {
    expect(withZero({ low: -3, high: -1 }, lane)).toEqual({ low: -3, high: 0 });
  });
});
