import { describe, expect, it } from "vitest";
import { covered } from "../../src/page/layout";

const over = (offsetTop: number, offsetHeight: number): { offsetTop: number; offsetHeight: number } => ({ offsetTop, offsetHeight });
const BAR = over(0, 52);

describe("what covers the stage", () => {
  it("is the line on top, and all that stands at the foot", () => {
    expect(covered(800, BAR, 120, over(0, 0))).toEqual([52, 120]);
  });

  it("is a tour's trace as well, where it stands: the object is seen beside it", () => {
    expect(covered(800, BAR, 80, over(60, 190))).toEqual([250, 80]);
    expect(covered(455, BAR, 0, over(260, 187))).toEqual([52, 195]);
  });
});
