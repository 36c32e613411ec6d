import { describe, expect, it } from "vitest";
import { eased, eye, facing, FARTHEST, HOME, NEAREST, nearTurn, rotated, zoomed } from "../../src/view/orbit";

const DT = 1 / 60;

describe("the camera", () => {
  it("keeps to its limits", () => {
    expect(zoomed(HOME, 1e6).distance).toBe(FARTHEST);
    expect(zoomed(HOME, 1e-6).distance).toBe(NEAREST);
    expect(rotated(HOME, 0, 99).elevation).toBeLessThan(Math.PI / 2);
  });

  it("is where its angles say", () => {
    const at = eye({ azimuth: 0, elevation: 0, distance: 5 }, [1, 2, 3], 0.1);
    expect(at[0]).toBeCloseTo(1.5, 9);
    expect(at[2]).toBeCloseTo(3, 9);
  });

  it("arrives, so that drawing can stop", () => {
    let at = HOME;
    const to = rotated(zoomed(HOME, 1.5), 1, 0.3);
    for (let i = 0; i < 120; i++) at = eased(at, to, DT);
    expect(at).toBe(to);
  });

  it("takes the short way round", () => {
    const far = { ...HOME, azimuth: HOME.azimuth + 6 * Math.PI + 0.2 };
    expect(nearTurn(facing([0, -1, 0]), far).azimuth - far.azimuth).toBeLessThan(Math.PI);
  });
});
