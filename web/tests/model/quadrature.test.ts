import { describe, expect, test } from "vitest";
import type { RestMesh } from "../../src/model/body";
import { pressure } from "../../src/watch/pressure";
import { quadratureOf } from "../../src/model/quadrature";
import { expectClose } from "../close";
import { example, type Ring } from "../watch/forces";

/** A ring of squares cut in two, as `test_forces_vector.py` makes it. */
function ringOf({ along, round, radius, tube }: Ring): RestMesh {
  const vertices: number[] = [];
  const faces: number[] = [];
  for (let i = 0; i < along; i += 1) {
    for (let j = 0; j < round; j += 1) {
      const [u, v] = [(2 * Math.PI * i) / along, (2 * Math.PI * j) / round];
      const out = radius + tube * Math.cos(v);
      vertices.push(out * Math.cos(u), out * Math.sin(u), tube * Math.sin(v));
      const [next, beside] = [((i + 1) % along) * round, (j + 1) % round];
      const [a, b, c, d] = [i * round + j, next + j, next + beside, i * round + beside];
      faces.push(a, b, c, a, c, d);
    }
  }
  return { vertices: Float32Array.from(vertices), faces: Uint32Array.from(faces) };
}

describe("on a fine mesh, as the server", () => {
  const fine = quadratureOf(ringOf(example.ring));

  test("a face carries one point; on one of 10,000 faces it still carries nine", () => {
    expect(fine.split).toBe(1);
    expect(quadratureOf(ringOf({ ...example.ring, along: 100, round: 50 })).split).toBe(9);
  });

  test.each(example.ring.contacts)("weights of a pressure of radius $radius", ({ foot, normal, radius, vertices, weights }) => {
    const found = pressure(fine, foot, normal, radius);
    expect(found.vertices).toEqual(vertices);
    expectClose(found.weights, weights, "weights", 1e-5, 1e-5);
  });
});
