import { expect, test } from "vitest";
import { nearestVertex } from "../../src/view/marks";

test("a mark lies at the nearest vertex of the resting surface, also one that was said to be far off", () => {
  const vertices = new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]);
  expect(nearestVertex(vertices, [0.9, 0.1, 0])).toBe(1);
  expect(nearestVertex(vertices, [0, 10, 10])).toBe(2);
});
