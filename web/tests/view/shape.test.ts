import { describe, expect, it } from "vitest";
import { norm, sub, type Vec3 } from "../../src/model/vec";
import { Shape } from "../../src/view/shape";

// A floor of 2 m, whose middle goes down as a finger goes in.
const FLOOR = {
  vertices: Float32Array.from([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0, 0, 0, 0]),
  faces: Uint32Array.from([0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4]),
};
const ASLANT: Vec3 = [Math.SQRT1_2, 0, -Math.SQRT1_2];

/** The floor with its middle so deep [m]. */
function dented(depth: number): Float32Array {
  return FLOOR.vertices.map((x, i) => (i === 14 ? -depth : x));
}

describe("a ray from aside that holds still", () => {
  it("meets another place as the dent under it grows, and not where a press took hold", () => {
    const shape = new Shape(FLOOR);
    const eye: Vec3 = [-1.02, 0.01, 1];
    const first = shape.meetGrasped(eye, ASLANT)?.surface ?? [NaN, 0, 0];
    shape.grasp();
    shape.positions = dented(0.1);
    const now = shape.meet(eye, ASLANT)?.surface ?? [NaN, 0, 0];
    const grasped = shape.meetGrasped(eye, ASLANT)?.surface ?? [NaN, 0, 0];
    expect(norm(sub(now, first))).toBeGreaterThan(0.05);
    expect(norm(sub(grasped, first))).toBeLessThan(1e-6);
  });

  it("goes by the surface as it is from the next press on", () => {
    const shape = new Shape(FLOOR);
    const eye: Vec3 = [-1.02, 0.01, 1];
    shape.grasp();
    shape.positions = dented(0.1);
    shape.grasp();
    expect(shape.meetGrasped(eye, ASLANT)).toEqual(shape.meet(eye, ASLANT));
  });
});
