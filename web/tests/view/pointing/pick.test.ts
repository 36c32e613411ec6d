import { describe, expect, it } from "vitest";
import { norm, type Vec3 } from "../../../src/model/vec";
import { at, pick, placeTowards } from "../../../src/view/pointing/pick";
import { sphere } from "../shapes";

describe("picking", () => {
  const { vertices, faces } = sphere(2);

  it("finds the front side and not the back", () => {
    const hit = pick(vertices, faces, [0.1, -5, 0.05], [0, 1, 0]);
    expect(hit?.point[1]).toBeLessThan(-0.9);
    expect(hit?.distance).toBeCloseTo(5 + (hit?.point[1] ?? 0), 5);
  });

  it("misses beside the body, and behind the eye", () => {
    expect(pick(vertices, faces, [2, -5, 0], [0, 1, 0])).toBeNull();
    expect(pick(vertices, faces, [0.1, 5, 0.05], [0, 1, 0])).toBeNull();
  });

  it("gives shares that lead back to the point, and follow the surface as it moves", () => {
    const hit = pick(vertices, faces, [0.2, -5, 0.3], [0, 1, 0]);
    if (hit === null) throw new Error("the ray must hit");
    const back = at(vertices, faces, hit);
    for (let k = 0; k < 3; k++) expect(back[k]).toBeCloseTo(hit.point[k] ?? 0, 6);
    const twice = at(vertices.map((x) => 2 * x), faces, hit);
    expect(twice[1]).toBeCloseTo(2 * hit.point[1], 5);
  });

  it("finds the place that looks in a direction", () => {
    const direction: Vec3 = [0.6, -0.8, 0];
    const found = placeTowards(vertices, faces, [0, 0, 0], direction, 1);
    if (found === null) throw new Error("a closed body has such a place");
    const p = at(vertices, faces, found);
    expect((p[0] * direction[0] + p[1] * direction[1]) / norm(p)).toBeGreaterThan(0.999);
  });
});
