import { describe, expect, it } from "vitest";
import { row } from "../../../src/model/vec";
import { alongNormals, vertexNormals } from "../../../src/view/body/normals";
import { sphere } from "../shapes";

describe("normals", () => {
  it("of a sphere point outwards, exactly", () => {
    const { vertices, faces } = sphere(3);
    const normals = vertexNormals(vertices, faces);
    for (let i = 0; i < vertices.length / 3; i++) {
      const [n, v] = [row(normals, i), row(vertices, i)];
      expect(n[0] * v[0] + n[1] * v[1] + n[2] * v[2]).toBeGreaterThan(1 - 1e-6);
    }
  });

  it("measure a dent as negative, and the largest magnitude", () => {
    const rest = Float32Array.from([0, 0, 1, 1, 0, 0]);
    const now = Float32Array.from([0, 0, 0.98, 1.01, 0, 0]);
    const out = new Float32Array(2);
    const most = alongNormals(now, rest, rest, out);
    expect(out[0]).toBeCloseTo(-0.02, 6);
    expect(out[1]).toBeCloseTo(0.01, 6);
    expect(most).toBeCloseTo(0.02, 6);
  });
});
