import { describe, expect, it } from "vitest";
import { StiffnessMap } from "../../../src/view/body/stiffness_map";

describe("the map of stiffness", () => {
  it("knows the touched places only", () => {
    const map = new StiffnessMap(Float32Array.from([0, 0, 0, 1, 0, 0]));
    expect(map.empty).toBe(true);
    expect(map.add([0, 0, 0], 250, 0.2)).toBe(true);
    expect([...map.values]).toEqual([250, 0]);
    expect([...map.known]).toEqual([1, 0]);
    expect(map.low).toBe(250);
  });

  it("comes to rest when the same is found again", () => {
    const map = new StiffnessMap(Float32Array.from([0, 0, 0]));
    map.add([0, 0, 0], 250, 0.2);
    expect(map.add([0, 0, 0], 250, 0.2)).toBe(false);
    expect(map.add([0, 0, 0], 500, 0.2)).toBe(true);
    for (let i = 0; i < 40; i++) map.add([0, 0, 0], 500, 0.2);
    expect(map.values[0]).toBeCloseTo(500, 0);
  });

  it("ignores invalid values", () => {
    const map = new StiffnessMap(new Float32Array(3));
    expect(map.add([0, 0, 0], Infinity, 1)).toBe(false);
    expect(map.add([0, 0, 0], 0, 1)).toBe(false);
    expect(map.empty).toBe(true);
  });
});
