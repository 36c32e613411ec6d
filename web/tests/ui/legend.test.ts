import { describe, expect, it } from "vitest";
import { legendWords } from "../../src/ui/legend";

describe("the legend", () => {
  it("is in millimetres, or in the stiffness that was measured", () => {
    expect(legendWords({ colouring: "displacement", low: -0.02, high: 0.02 })).toEqual(["20 mm in", "at rest", "20 mm out"]);
    expect(legendWords({ colouring: "stiffness", low: null, high: null })[1]).toBe("touch it to find out");
    expect(legendWords({ colouring: "stiffness", low: 120, high: 251 })[2]).toBe("251 N/m");
    expect(legendWords({ colouring: "stiffness", low: 271.9, high: 272.2 })).toEqual(["", "272 N/m where it was touched", ""]);
  });
});
